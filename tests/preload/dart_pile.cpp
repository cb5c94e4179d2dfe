// Boxes that fall, simulated by DART (Debian: libdart-collision-ode-dev), whose ODE collision
// detector makes a hash space, sets its levels and collides it for contacts.
//
//     dart_pile [bodies [frames]]
#include <cstdio>
#include <cstdlib>
#include <dart/collision/ode/OdeCollisionDetector.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/simulation/World.hpp>
#include <string>

namespace {

dart::dynamics::SkeletonPtr makeBox(const std::string& name, const Eigen::Vector3d& size,
                                    const Eigen::Vector3d& place, bool moves) {
  using namespace dart::dynamics;
  const auto skeleton = Skeleton::create(name);
  const auto body = skeleton->createJointAndBodyNodePair<FreeJoint>().second;
  body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(std::make_shared<BoxShape>(size));
  skeleton->setMobile(moves);
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translation() = place;
  FreeJoint::setTransformOf(body, transform);
  return skeleton;
}

}  // namespace

int main(int argc, char** argv) {
  const int bodies = argc > 1 ? std::atoi(argv[1]) : 100;
  const int frames = argc > 2 ? std::atoi(argv[2]) : 100;
  const auto world = dart::simulation::World::create();
  world->getConstraintSolver()->setCollisionDetector(
      dart::collision::OdeCollisionDetector::create());
  world->addSkeleton(makeBox("ground", {40, 40, 1}, {20, 20, 19.5}, false));
  for (int i = 0; i < bodies; ++i)
    world->addSkeleton(
        makeBox(std::to_string(i), {0.9, 0.9, 0.9},
                {15 + 1.1 * (i % 10), 15 + 1.2 * (i / 10 % 10), 20.46 + 0.91 * (i / 100)}, true));
  for (int frame = 0; frame < frames; ++frame) world->step();
  double heights = 0;
  for (std::size_t i = 1; i < world->getNumSkeletons(); ++i)
    heights += world->getSkeleton(i)->getCOM()[2];
  std::printf("%d bodies, sum of heights %.9f\n", bodies, heights);
}
