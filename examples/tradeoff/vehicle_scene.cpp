#include "scenes.h"

#include <memory>

#include "../pile/random.h"

namespace tradeoff {
namespace {

using pile::Random;

constexpr int bodies_each = 5;
constexpr double lane = 4;  // metres from one vehicle to the next
constexpr double length = 1.6;
constexpr double width = 0.8;
constexpr double wheel = 0.3;  // radius
constexpr double bump_radius = 0.5;
constexpr double drives = 4;     // seconds, then it brakes
constexpr double speed = 3;      // m/s
constexpr double torque = 150;   // N m, of each wheel's motor
constexpr double bounces = 2;    // Hz, of the chassis on its springs
constexpr double damping = 0.5;  // of the critical one

class Fleet {
 public:
  explicit Fleet(int count) : count_(count) {}

  void build(dWorldID world, dSpaceID space, unsigned long seed) {
    Random random(seed);
    dCreatePlane(space, 0, 0, 1, 0);
    for (int i = 0; i < count_; ++i) {
      const double y = lane * i;
      addBumps(space, random, y);
      const dBodyID chassis = addBox(world, space, {length, width, 0.3}, {0, y, wheel + 0.35});
      chassis_.push_back(chassis);
      for (double x : {-0.6, 0.6})
        for (double side : {-0.5, 0.5}) addWheel(world, space, chassis, {x, y + side, wheel});
    }
  }

  // A spring of so much stiffness and damping is another ERP and CFM with each step.
  void prepare(double dt) {
    const double rate = 2 * pi * bounces;
    for (size_t i = 0; i < axles_.size(); ++i) {
      const double load = massOf(chassis_[i / 4]) / 4;
      const double stiffness = load * rate * rate, resistance = 2 * damping * load * rate;
      const double both = dt * stiffness + resistance;
      dJointSetHinge2Param(axles_[i], dParamSuspensionERP, real(dt * stiffness / both));
      dJointSetHinge2Param(axles_[i], dParamSuspensionCFM, real(1 / both));
    }
  }

  void control(double time) {
    for (dJointID axle : axles_)
      dJointSetHinge2Param(axle, dParamVel2, real(time < drives ? speed / wheel : 0));
  }

  // Off by its own length is an error of 100 %.
  std::vector<Observation> observe() const {
    std::vector<Observation> seen;
    for (size_t i = 0; i < chassis_.size(); ++i) {
      const Vector place = vectorOf(dBodyGetPosition(chassis_[i]));
      seen.push_back({"way_" + std::to_string(i + 1), place[0], length});
      seen.push_back({"aside_" + std::to_string(i + 1), place[1] - lane * double(i), length});
    }
    return seen;
  }

 private:
  // Round bars across half of the lane, on either side by chance, 2 to 6 cm high.
  static void addBumps(dSpaceID space, Random& random, double y) {
    dMatrix3 across;
    dRFromAxisAndAngle(across, 1, 0, 0, real(pi / 2));
    for (double x = 2; x < speed * drives + 2; x += random.uniform(0.8, 1.4)) {
      const double high = random.uniform(0.02, 0.06), side = random.uniform(-1, 1);
      const dGeomID bump = dCreateCapsule(space, real(bump_radius), 1);
      dGeomSetRotation(bump, across);
      dGeomSetPosition(bump, real(x), real(y + side), real(high - bump_radius));
    }
  }

  // It collides as a ball, and weighs what a disc does.
  void addWheel(dWorldID world, dSpaceID space, dBodyID chassis, const Vector& place) {
    dMass mass;
    dMassSetCylinder(&mass, real(density), 2, real(wheel), real(0.2));
    const dBodyID body = addBody(world, dCreateSphere(space, real(wheel)), mass, place);
    const dJointID axle = dJointCreateHinge2(world, nullptr);
    dJointAttach(axle, chassis, body);
    const dVector3 up = {0, 0, 1}, across = {0, -1, 0};
    dJointSetHinge2Anchor(axle, real(place[0]), real(place[1]), real(place[2]));
    dJointSetHinge2Axes(axle, up, across);
    dJointSetHinge2Param(axle, dParamLoStop, 0);  // not steered
    dJointSetHinge2Param(axle, dParamHiStop, 0);
    dJointSetHinge2Param(axle, dParamFMax2, real(torque));
    axles_.push_back(axle);
  }

  int count_;
  std::vector<dBodyID> chassis_;
  std::vector<dJointID> axles_;  // four for each
};

}  // namespace

Scene vehicleScene(int bodies) {
  const auto fleet = std::make_shared<Fleet>(std::max(1, bodies / bodies_each));
  Scene scene;
  scene.build = [fleet](dWorldID world, dSpaceID space, unsigned long seed) {
    fleet->build(world, space, seed);
  };
  scene.prepare = [fleet](double dt) { fleet->prepare(dt); };
  scene.control = [fleet](double time) { fleet->control(time); };
  scene.observe = [fleet] { return fleet->observe(); };
  scene.seconds = 10;
  return scene;
}

}  // namespace tradeoff
