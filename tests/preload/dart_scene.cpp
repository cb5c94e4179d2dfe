// Scenes of DART (Debian: libdart-collision-ode-dev), whose ODE collision detector makes a hash
// space, sets its levels, and asks dCollide for up to 250 contacts of each pair.
//
//     dart_scene far
//     dart_scene shapes|columns [COUNT [FRAMES]]
//
// far: a body at 1e9 m beside one that falls onto the ground. shapes: COUNT boxes, spheres and
// cylinders each (1,001) in three rows on a ground plane, as in Gazebo Sim's world 3k_shapes,
// simulated. columns: the same shapes, so that each touches what is beside and below it, collided
// only. Prints sums of what was found.
#include <cstdio>
#include <cstdlib>
#include <dart/collision/ode/OdeCollisionDetector.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/CylinderShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/PlaneShape.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
#include <memory>
#include <string>
#include <vector>

namespace {

using namespace dart::dynamics;

Eigen::Isometry3d at(double x, double y, double z) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translation() << x, y, z;
  return transform;
}

// On a ground plane.
class Scene {
 public:
  Scene() : world_(dart::simulation::World::create()) {
    auto& solver = *world_->getConstraintSolver();
    solver.setCollisionDetector(dart::collision::OdeCollisionDetector::create());
    solver.getCollisionOption().maxNumContacts = 100000;  // more than any scene here has
    world_->setTimeStep(0.001);
    const auto ground = Skeleton::create("ground");
    const auto body = ground->createJointAndBodyNodePair<WeldJoint>().second;
    body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(
        std::make_shared<PlaneShape>(Eigen::Vector3d::UnitZ(), 0.0));
    ground->setMobile(false);
    world_->addSkeleton(ground);
  }

  void add(const ShapePtr& shape, const Eigen::Isometry3d& transform) {
    const auto skeleton = Skeleton::create(std::to_string(bodies_.size()));
    const auto body = skeleton->createJointAndBodyNodePair<FreeJoint>().second;
    body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(shape);
    FreeJoint::setTransformOf(body, transform);
    world_->addSkeleton(skeleton);
    bodies_.push_back(body);
  }

  // Where `place` says where each body is in each frame they are collided only, else simulated.
  void run(int frames, Eigen::Isometry3d (*place)(int body, int frame)) {
    for (int frame = 0; frame < frames; ++frame) {
      if (!place) {
        world_->step();
        note(world_->getLastCollisionResult());
        continue;
      }
      for (std::size_t i = 0; i < bodies_.size(); ++i)
        FreeJoint::setTransformOf(bodies_[i], place(static_cast<int>(i), frame));
      dart::collision::CollisionResult result;
      auto& solver = *world_->getConstraintSolver();
      solver.getCollisionGroup()->collide(solver.getCollisionOption(), &result);
      note(result);
    }
  }

  void print() const {
    double heights = 0, poses = 0;
    for (const auto* body : bodies_) {
      heights += body->getWorldTransform().translation().z();
      poses += body->getWorldTransform().matrix().sum();
    }
    std::printf("%zu shapes, mean height %.6f, poses %.17g, %zu contacts %.17g\n", bodies_.size(),
                heights / static_cast<double>(bodies_.size()), poses, contacts_, sum_);
  }

 private:
  void note(const dart::collision::CollisionResult& result) {
    contacts_ += result.getNumContacts();
    for (const auto& contact : result.getContacts())
      sum_ += contact.penetrationDepth + contact.point.sum() + contact.normal.sum();
  }

  const dart::simulation::WorldPtr world_;
  std::vector<BodyNode*> bodies_;
  std::size_t contacts_ = 0;
  double sum_ = 0;  // of what contacts are made of
};

Eigen::Isometry3d placeInColumns(int i, int frame) {
  constexpr int side = 20;
  const double sway = 0.001 * ((i * 7 + frame * 13) % 11);
  return at(20 + 0.97 * (i % side) + sway, 20 + 0.98 * (i / side % side),
            0.49 + 0.97 * (i / side / side) - sway);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "shapes";
  const int count = argc > 2 ? std::atoi(argv[2]) : 1001;
  const int frames = argc > 3 ? std::atoi(argv[3]) : 100;
  const ShapePtr shapes[] = {std::make_shared<CylinderShape>(0.5, 1.0),
                             std::make_shared<BoxShape>(Eigen::Vector3d(1, 1, 1)),
                             std::make_shared<SphereShape>(0.5)};
  Scene scene;
  if (name == "far") {
    scene.add(shapes[1], at(0, 0, 0.6));
    scene.add(std::make_shared<SphereShape>(0.1), at(-1e9, 0, 1));
    scene.run(300, nullptr);
  } else if (name == "columns") {
    for (int i = 0; i < 3 * count; ++i) scene.add(shapes[i % 3], placeInColumns(i, 0));
    scene.run(frames, placeInColumns);
  } else {  // a shape's width and a half apart
    for (int i = 0; i < 3 * count; ++i)
      scene.add(shapes[i % 3], at(1.5 * (i / 3 - count / 2), 1.5 * (i % 3 - 1), 0.5));
    scene.run(frames, nullptr);
  }
  scene.print();
}
