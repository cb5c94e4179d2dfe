// Scenes of DART (Debian: libdart-collision-ode-dev), whose ODE collision detector makes a hash
// space, sets its levels, and asks dCollide for up to 250 contacts of each pair.
//
//     dart_scene far
//     dart_scene shapes|columns [COUNT [FRAMES]]
//
// far: a body at 1e9 m beside one that falls onto the ground. shapes: COUNT boxes, spheres and
// cylinders each (1,001) in three rows on a ground plane, as in Gazebo Sim's world 3k_shapes,
// simulated. columns: the same shapes, so that each touches what is beside and below it, collided
// only. Prints what was found, in a way that does not depend on the order of pairs, and to stderr
// what a step took on average over the second half of the frames.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
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

// What a run found, added up so that the order in which it came does not matter.
struct Digest {
  unsigned long long contacts = 0;
  std::uint64_t bits = 0;

  void add(double number) {
    if (number == 0) number = 0;  // -0 is another
    std::uint64_t mixed;
    std::memcpy(&mixed, &number, sizeof mixed);
    mixed = (mixed ^ mixed >> 31) * 0x9e3779b97f4a7c15u;
    bits += (mixed ^ mixed >> 29) * 0xbf58476d1ce4e5b9u;
  }
  // Pairs may come with their geoms swapped, and with their normal turned round.
  void add(const dart::collision::Contact& contact) {
    ++contacts;
    add(contact.penetrationDepth);
    for (int i = 0; i < 3; ++i) {
      add(contact.point[i]);
      add(std::abs(contact.normal[i]));
    }
  }
};

// DART's detector; notes what it finds.
class NotingDetector : public dart::collision::OdeCollisionDetector {
 public:
  bool collide(dart::collision::CollisionGroup* group, const CollisionOption& option,
               CollisionResult* result) override {
    const bool any = OdeCollisionDetector::collide(group, option, result);
    if (result)
      for (const auto& contact : result->getContacts()) digest.add(contact);
    return any;
  }
  using OdeCollisionDetector::collide;

  Digest digest;
};

Eigen::Isometry3d at(double x, double y, double z) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translation() << x, y, z;
  return transform;
}

class Scene {
 public:
  Scene() : detector(std::make_shared<NotingDetector>()), world(dart::simulation::World::create()) {
    auto& solver = *world->getConstraintSolver();
    solver.setCollisionDetector(detector);
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

  const std::shared_ptr<NotingDetector> detector;
  const dart::simulation::WorldPtr world;
  std::vector<dart::dynamics::BodyNode*> bodies;
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
}

void printResult(const Scene& scene) {
  Digest poses;
  double heights = 0;
  for (const auto* body : scene.bodies) {
    for (int i = 0; i < 16; ++i) poses.add(body->getWorldTransform().matrix()(i / 4, i % 4));
    heights += body->getWorldTransform().translation().z();
  }
  const Digest& contacts = scene.detector->digest;
  std::printf("%zu shapes, mean height %.6f, poses %016llx, %llu contacts %016llx\n",
              scene.bodies.size(), heights / static_cast<double>(scene.bodies.size()),
              static_cast<unsigned long long>(poses.bits), contacts.contacts,
              static_cast<unsigned long long>(contacts.bits));
}

void run(Scene& scene, bool simulates, int frames) {
  Clock::time_point begin;
  for (int frame = 0; frame < frames; ++frame) {
    if (frame == frames / 2) begin = Clock::now();
    if (simulates)
      scene.world->step();
    else
      collideColumns(scene, frame);
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
