// Scenes of DART (Debian: libdart-collision-ode-dev), whose ODE collision detector makes a hash
// space, sets its levels, and asks dCollide for up to 250 contacts of each pair.
//
//     dart_scene far
//     dart_scene shapes|columns [COUNT [FRAMES]]
//
// far: a body at 1e9 m beside one that falls onto the ground. shapes: COUNT boxes, spheres and
// cylinders each (1,001) in three rows on a ground plane, as in Gazebo Sim's world 3k_shapes,
// simulated. columns: the same shapes, so that each touches what is beside and below it, collided
// only. Prints sums of what was found, and to stderr what a step took on average over the second
// half of the frames.
#include <chrono>
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

using dart::collision::CollisionOption;
using dart::collision::CollisionResult;
using Clock = std::chrono::steady_clock;

Eigen::Isometry3d at(double x, double y, double z) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translation() << x, y, z;
  return transform;
}

class Scene {
 public:
  Scene() : world(dart::simulation::World::create()) {
    auto& solver = *world->getConstraintSolver();
    solver.setCollisionDetector(dart::collision::OdeCollisionDetector::create());
    solver.getCollisionOption().maxNumContacts = 100000;  // more than any scene here has
    world->setTimeStep(0.001);
    using namespace dart::dynamics;
    const auto ground = Skeleton::create("ground");
    const auto body = ground->createJointAndBodyNodePair<WeldJoint>().second;
    body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(
        std::make_shared<PlaneShape>(Eigen::Vector3d::UnitZ(), 0.0));
    ground->setMobile(false);
    world->addSkeleton(ground);
  }

  void add(const dart::dynamics::ShapePtr& shape, const Eigen::Isometry3d& transform) {
    using namespace dart::dynamics;
    const auto skeleton = Skeleton::create(std::to_string(bodies.size()));
    const auto body = skeleton->createJointAndBodyNodePair<FreeJoint>().second;
    body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(shape);
    FreeJoint::setTransformOf(body, transform);
    world->addSkeleton(skeleton);
    bodies.push_back(body);
  }

  const dart::simulation::WorldPtr world;
  std::vector<dart::dynamics::BodyNode*> bodies;
  std::size_t contacts = 0;
  double sum = 0;  // of what contacts are made of

  void note(const CollisionResult& result) {
    contacts += result.getNumContacts();
    for (const auto& contact : result.getContacts())
      sum += contact.penetrationDepth + contact.point.sum() + contact.normal.sum();
  }
};

std::vector<dart::dynamics::ShapePtr> threeShapes() {
  using namespace dart::dynamics;
  return {std::make_shared<CylinderShape>(0.5, 1.0),
          std::make_shared<BoxShape>(Eigen::Vector3d(1, 1, 1)), std::make_shared<SphereShape>(0.5)};
}

// Rows along x, a shape's width and a half apart.
void addRows(Scene& scene, int count) {
  const auto shapes = threeShapes();
  for (int i = 0; i < count; ++i)
    for (int row = 0; row < 3; ++row)
      scene.add(shapes[row], at(1.5 * (i - count / 2), 1.5 * (row - 1), 0.5));
}

Eigen::Isometry3d placeInColumns(int i, int frame) {
  constexpr int side = 20;
  const double sway = 0.001 * ((i * 7 + frame * 13) % 11);
  return at(20 + 0.97 * (i % side) + sway, 20 + 0.98 * (i / side % side),
            0.49 + 0.97 * (i / side / side) - sway);
}

void addColumns(Scene& scene, int count) {
  const auto shapes = threeShapes();
  for (int i = 0; i < 3 * count; ++i) scene.add(shapes[i % 3], placeInColumns(i, 0));
}

void collideColumns(Scene& scene, int frame) {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i)
    dart::dynamics::FreeJoint::setTransformOf(scene.bodies[i],
                                              placeInColumns(static_cast<int>(i), frame));
  CollisionResult result;
  auto& solver = *scene.world->getConstraintSolver();
  solver.getCollisionGroup()->collide(solver.getCollisionOption(), &result);
  scene.note(result);
}

void printResult(const Scene& scene) {
  double heights = 0, poses = 0;
  for (const auto* body : scene.bodies) {
    heights += body->getWorldTransform().translation().z();
    poses += body->getWorldTransform().matrix().sum();
  }
  std::printf("%zu shapes, mean height %.6f, poses %.17g, %zu contacts %.17g\n",
              scene.bodies.size(), heights / static_cast<double>(scene.bodies.size()), poses,
              scene.contacts, scene.sum);
}

void run(Scene& scene, bool simulates, int frames) {
  Clock::time_point begin;
  for (int frame = 0; frame < frames; ++frame) {
    if (frame == frames / 2) begin = Clock::now();
    if (simulates) {
      scene.world->step();
      scene.note(scene.world->getLastCollisionResult());
    } else {
      collideColumns(scene, frame);
    }
  }
  const std::chrono::duration<double, std::milli> ms = Clock::now() - begin;
  std::fprintf(stderr, "a step: %.3f ms\n", ms.count() / (frames - frames / 2));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "shapes";
  const int count = argc > 2 ? std::atoi(argv[2]) : 1001;
  const int frames = argc > 3 ? std::atoi(argv[3]) : 100;
  Scene scene;
  if (name == "far") {
    scene.add(threeShapes()[1], at(0, 0, 0.6));
    scene.add(std::make_shared<dart::dynamics::SphereShape>(0.1), at(-1e9, 0, 1));
    run(scene, true, 300);
  } else if (name == "columns") {
    addColumns(scene, count);
    run(scene, false, frames);
  } else {
    addRows(scene, count);
    run(scene, true, frames);
  }
  printResult(scene);
}
