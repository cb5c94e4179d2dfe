// The study's own scenes, each played once: tradeoff-point NAME [--SETTING VALUE]...
#include <algorithm>
#include <cmath>

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

// A body with this geom, not damped: damping would hide errors.
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

// Boxes of 0.6 to 1 m fall in layers of nine into a pit of planes, tilted a little so that they do
// not stack like bricks.
void buildHeap(dWorldID world, dSpaceID space, unsigned long seed) {
  constexpr double cell = 1.6, layer = 1.25;
  constexpr double tilt = 0.1;  // radians
  Random random(seed);
  dCreatePlane(space, 0, 0, 1, 0);
  for (int sign : {1, -1}) {
    dCreatePlane(space, real(sign), 0, 0, real(-1.5 * cell));
    dCreatePlane(space, 0, real(sign), 0, real(-1.5 * cell));
  }
  for (int i = 0; i < 40; ++i) {
    Vector side;
    for (double& length : side) length = random.uniform(0.6, 1.0);
    const double x = cell * (i % 3 - 1), y = cell * (i / 3 % 3 - 1);
    const dBodyID body = addBox(world, space, side, {x, y, 1 + layer * (i / 9)});
    const double angle = random.uniform(0, pi);
    const dQuaternion turn = {real(std::cos(angle / 2)), real(random.uniform(-tilt, tilt)),
                              real(random.uniform(-tilt, tilt)), real(std::sin(angle / 2))};
    dBodySetQuaternion(body, turn);
  }
}

// Twelve cubes of 1 m on one another, each up to 2 cm beside the one below.
void buildTower(dWorldID world, dSpaceID space, unsigned long seed) {
  Random random(seed);
  dCreatePlane(space, 0, 0, 1, 0);
  for (int i = 0; i < 12; ++i)
    addBox(world, space, {1, 1, 1},
           {random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), 0.5 + 1.001 * i});
}

// Six links in a row from a post, each on a motor that swings its joint; the last one holds a tool.
class Arm {
 public:
  void build(dWorldID world, dSpaceID space, unsigned long seed) {
    constexpr double length = 0.3;
    phase_ = Random(seed).uniform(0, 2 * pi);
    dBodyID last = nullptr;
    for (int i = 0; i < 6; ++i) {
      const dBodyID link =
          addBox(world, space, {length - 0.02, 0.06, 0.06}, {length * (i + 0.5), 0, 3});
      const dJointID joint = dJointCreateHinge(world, nullptr);
      dJointAttach(joint, link, last);
      dJointSetHingeAnchor(joint, real(length * i), 0, 3);
      dJointSetHingeAxis(joint, 0, 1, 0);
      dJointSetHingeParam(joint, dParamFMax, 10000);
      joints_.push_back(joint);
      last = link;
    }
    dMass mass;
    dMassSetSphere(&mass, 8000, real(0.03));
    tool_ = addBody(world, dCreateSphere(space, real(0.03)), mass, {6 * length + 0.05, 0, 3});
    const dJointID grip = dJointCreateFixed(world, nullptr);
    dJointAttach(grip, tool_, last);
    dJointSetFixed(grip);
  }

  void control(double time) {
    for (size_t i = 0; i < joints_.size(); ++i) {
      const double begun = phase_ + double(i), now = 1.5 * time + begun;
      const double wanted = 0.3 * (std::sin(now) - std::sin(begun));
      const double angle = double(dJointGetHingeAngle(joints_[i]));
      dJointSetHingeParam(joints_[i], dParamVel,
                          real(0.45 * std::cos(now) + 10 * (wanted - angle)));
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

Scene sceneNamed(const std::string& name) {
  static Arm arm;
  Scene scene;
  scene.undriven = name != "arm";
  if (name == "heap") {
    scene.build = buildHeap;
  } else if (name == "tower") {
    scene.build = buildTower;
    scene.seconds = 4;
  } else if (name == "arm") {
    scene.build = [](auto... all) { arm.build(all...); };
    scene.control = [](double time) { arm.control(time); };
    scene.observe = [] { return arm.observe(); };
    scene.observe_every = 1;
    scene.observe_from = 2;
    scene.seconds = 3;
    scene.rests = false;
    scene.ignores = "height+spread+energy";
  } else {
    throw std::invalid_argument("no such scene: " + name);
  }
  return scene;
}

}  // namespace
}  // namespace tradeoff

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw std::invalid_argument("which scene? arm, tower or heap");
    return tradeoff::run(argc - 1, argv + 1, tradeoff::sceneNamed(argv[1]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 2;
  }
}
