// The study's own scenes, each run once: tradeoff-point NAME BODIES [--SETTING VALUE...]
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "../pile/random.h"
#include "harness.h"

namespace tradeoff {
namespace {

using pile::Random;

constexpr double pi = 3.14159265358979;
constexpr double density = 1000;  // kg/m^3: water, wood, plastics; stone has 2,500, steel 8,000

dReal real(double value) {
  return static_cast<dReal>(value);
}

// A body with this geom, not damped: damping would hide errors; and what sleeps is for the settings
// to say.
dBodyID addBody(dWorldID world, dGeomID geom, const dMass& mass, const Vector& place) {
  const dBodyID body = dBodyCreate(world);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, real(place[0]), real(place[1]), real(place[2]));
  dGeomSetBody(geom, body);
  dBodySetLinearDamping(body, 0);
  dBodySetAngularDamping(body, 0);
  return body;
}

dBodyID addBox(dWorldID world, dSpaceID space, const Vector& side, const Vector& place) {
  dMass mass;
  dMassSetBox(&mass, real(density), real(side[0]), real(side[1]), real(side[2]));
  return addBody(world, dCreateBox(space, real(side[0]), real(side[1]), real(side[2])), mass,
                 place);
}

// The middle of a cell of a layer of `across` by `across` of them, above the origin; the layer's
// number is i / across^2.
Vector cellOf(int i, int across, double cell) {
  return {cell * (i % across - (across - 1) / 2.0),
          cell * (i / across % across - (across - 1) / 2.0), cell * (i / (across * across))};
}

// Boxes of 0.6 to 1 m in layers over a pit of planes that is about as wide as a layer, tilted a
// little so that they do not stack like bricks.
void buildHeap(dWorldID world, dSpaceID space, Random random, int bodies) {
  constexpr double cell = 1.6;
  constexpr double layer = 1.25;
  constexpr double tilt = 0.1;  // radians
  const int across = std::max(2, static_cast<int>(std::lround(std::cbrt(bodies / 2.0))));
  const dReal wall = real(-cell * across / 2);
  dCreatePlane(space, 0, 0, 1, 0);
  for (int sign : {1, -1}) {
    dCreatePlane(space, real(sign), 0, 0, wall);
    dCreatePlane(space, 0, real(sign), 0, wall);
  }
  for (int i = 0; i < bodies; ++i) {
    Vector side;
    for (double& length : side) length = random.uniform(0.6, 1.0);
    const Vector at = cellOf(i, across, cell);
    const dBodyID body =
        addBox(world, space, side, {at[0], at[1], 1 + layer * (i / (across * across))});
    const double angle = random.uniform(0, pi);
    dQuaternion turn = {real(std::cos(angle / 2)), real(random.uniform(-tilt, tilt)),
                        real(random.uniform(-tilt, tilt)), real(std::sin(angle / 2))};
    dBodySetQuaternion(body, turn);
  }
}

// Cubes of 1 m on one another, each up to 2 cm beside the one below.
void buildTower(dWorldID world, dSpaceID space, Random random, int bodies) {
  dCreatePlane(space, 0, 0, 1, 0);
  for (int i = 0; i < bodies; ++i)
    addBox(world, space, {1, 1, 1},
           {random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), 0.5 + 1.001 * i});
}

constexpr int bodies_each = 5;
constexpr double lane = 4;  // metres from one vehicle to the next
constexpr double chassis_length = 1.6;
constexpr double chassis_width = 0.8;
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
      const dBodyID chassis =
          addBox(world, space, {chassis_length, chassis_width, 0.3}, {0, y, wheel + 0.35});
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
      seen.push_back({"way_" + std::to_string(i + 1), place[0], chassis_length});
      seen.push_back(
          {"aside_" + std::to_string(i + 1), place[1] - lane * double(i), chassis_length});
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

// Vehicles of five bodies each drive over bumps for some seconds, brake and stand.
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

constexpr double link_length = 0.3;

// Links in a row from a post, each on a motor that swings its joint; the last one holds a tool.
class Arm {
 public:
  explicit Arm(int links) : joints_(static_cast<size_t>(links)) {}

  void build(dWorldID world, dSpaceID space, unsigned long seed) {
    phase_ = Random(seed).uniform(0, 2 * pi);
    dBodyID last = nullptr;
    for (size_t i = 0; i < joints_.size(); ++i) {
      const double x = link_length * double(i);
      const dBodyID link =
          addBox(world, space, {link_length - 0.02, 0.06, 0.06}, {x + link_length / 2, 0, 3});
      joints_[i] = dJointCreateHinge(world, nullptr);
      dJointAttach(joints_[i], link, last);
      dJointSetHingeAnchor(joints_[i], real(x), 0, 3);
      dJointSetHingeAxis(joints_[i], 0, 1, 0);
      dJointSetHingeParam(joints_[i], dParamFMax, 10000);
      last = link;
    }
    dMass mass;
    dMassSetSphere(&mass, 8000, real(0.03));
    tool_ = addBody(world, dCreateSphere(space, real(0.03)), mass,
                    {link_length * double(joints_.size()) + 0.05, 0, 3});
    const dJointID grip = dJointCreateFixed(world, nullptr);
    dJointAttach(grip, tool_, last);
    dJointSetFixed(grip);
  }

  void control(double time) {
    for (size_t i = 0; i < joints_.size(); ++i) {
      const double now = 1.5 * time + phase_ + double(i), wanted = 0.3 * std::sin(now);
      const double begun = 0.3 * std::sin(phase_ + double(i));
      const double angle = double(dJointGetHingeAngle(joints_[i]));
      dJointSetHingeParam(joints_[i], dParamVel,
                          real(0.45 * std::cos(now) + 10 * (wanted - begun - angle)));
    }
  }

  // Off by 5 cm is an error of 100 %.
  std::vector<Observation> observe() const {
    const Vector place = vectorOf(dBodyGetPosition(tool_));
    return {{"x", place[0], 0.05}, {"z", place[2], 0.05}};
  }

 private:
  std::vector<dJointID> joints_;
  dBodyID tool_ = nullptr;
  double phase_ = 0;
};

Scene armScene(int bodies) {
  const auto arm = std::make_shared<Arm>(std::max(2, bodies) - 1);
  Scene scene;
  scene.build = [arm](dWorldID world, dSpaceID space, unsigned long seed) {
    arm->build(world, space, seed);
  };
  scene.control = [arm](double time) { arm->control(time); };
  scene.observe = [arm] { return arm->observe(); };
  scene.observe_every = 1;
  scene.observe_from = 2;
  scene.seconds = 3;
  scene.rests = false;
  scene.ignores = "height+spread+jitter+drift+energy";
  return scene;
}

Scene sceneNamed(const std::string& name, int bodies) {
  if (name == "vehicle") return vehicleScene(bodies);
  if (name == "arm") return armScene(bodies);
  using Build = void (*)(dWorldID, dSpaceID, Random, int);
  static const std::map<std::string, Build> builds = {{"heap", buildHeap}, {"tower", buildTower}};
  const auto found = builds.find(name);
  if (found == builds.end()) throw std::invalid_argument("no such scene: " + name);
  Scene scene;
  scene.build = [build = found->second, bodies](dWorldID world, dSpaceID space,
                                                unsigned long seed) {
    build(world, space, Random(seed), bodies);
  };
  scene.seconds = 20;
  scene.stands = name == "tower";
  scene.undriven = true;
  return scene;
}

}  // namespace
}  // namespace tradeoff

int main(int argc, char** argv) {
  try {
    if (argc < 3) throw std::invalid_argument("which scene, and of how many bodies?");
    const tradeoff::Scene scene = tradeoff::sceneNamed(argv[1], std::max(1, std::atoi(argv[2])));
    return tradeoff::run(argc - 2, argv + 2, scene);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 2;
  }
}
