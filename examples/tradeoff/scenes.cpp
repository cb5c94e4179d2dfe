// The study's own scenes, each played once: tradeoff-point NAME [--SETTING VALUE]...
#include "../pile/random.h"
#include "harness.h"

namespace {

using pile::Random;
using tradeoff::Vector;

constexpr double pi = 3.14159265358979;

// Of 1,000 kg/m^3: water, wood, plastics. Not damped: damping would hide errors.
dBodyID addBox(dWorldID world, dSpaceID space, const Vector& side, const Vector& place) {
  const dReal x = dReal(side[0]), y = dReal(side[1]), z = dReal(side[2]);
  const dBodyID body = dBodyCreate(world);
  dMass mass;
  dMassSetBox(&mass, 1000, x, y, z);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, dReal(place[0]), dReal(place[1]), dReal(place[2]));
  dGeomSetBody(dCreateBox(space, x, y, z), body);
  dBodySetLinearDamping(body, 0);
  dBodySetAngularDamping(body, 0);
  return body;
}

// Boxes of 0.6 to 1 m fall in layers of nine into a pit of planes, tilted a little so that they do
// not stack like bricks.
void buildHeap(dWorldID world, dSpaceID space, unsigned long seed) {
  constexpr double cell = 1.6, layer = 1.25, tilt = 0.1;  // metres, radians
  Random random(seed);
  dCreatePlane(space, 0, 0, 1, 0);
  for (int sign : {1, -1}) {
    dCreatePlane(space, dReal(sign), 0, 0, dReal(-1.5 * cell));
    dCreatePlane(space, 0, dReal(sign), 0, dReal(-1.5 * cell));
  }
  for (int i = 0; i < 40; ++i) {
    Vector side;
    for (double& length : side) length = random.uniform(0.6, 1.0);
    const double x = cell * (i % 3 - 1), y = cell * (i / 3 % 3 - 1);
    const dBodyID body = addBox(world, space, side, {x, y, 1 + layer * (i / 9)});
    const double angle = random.uniform(0, pi);
    const dQuaternion turn = {dReal(std::cos(angle / 2)), dReal(random.uniform(-tilt, tilt)),
                              dReal(random.uniform(-tilt, tilt)), dReal(std::sin(angle / 2))};
    dBodySetQuaternion(body, turn);
  }
}

// Twelve cubes of 1 m on one another, each up to 2 cm beside the one below.
void buildTower(dWorldID world, dSpaceID space, unsigned long seed) {
  Random random(seed);
  dCreatePlane(space, 0, 0, 1, 0);
  for (int i = 0; i < 12; ++i) {
    const double x = random.uniform(-0.02, 0.02), y = random.uniform(-0.02, 0.02);
    addBox(world, space, {1, 1, 1}, {x, y, 0.5 + 1.001 * i});
  }
}

// Six links in a row from a post, each on a motor that swings its joint; the last one holds a tool
// of 1 kg.
std::vector<dJointID> joints;
dBodyID tool;
double phase;

void buildArm(dWorldID world, dSpaceID space, unsigned long seed) {
  constexpr double length = 0.3;
  phase = Random(seed).uniform(0, 2 * pi);
  dBodyID last = nullptr;
  for (int i = 0; i < 6; ++i) {
    const dBodyID link = addBox(world, space, {0.28, 0.06, 0.06}, {length * (i + 0.5), 0, 3});
    const dJointID joint = dJointCreateHinge(world, nullptr);
    dJointAttach(joint, link, last);
    dJointSetHingeAnchor(joint, dReal(length * i), 0, 3);
    dJointSetHingeAxis(joint, 0, 1, 0);
    dJointSetHingeParam(joint, dParamFMax, 10000);
    joints.push_back(joint);
    last = link;
  }
  tool = addBox(world, space, {0.1, 0.1, 0.1}, {6 * length + 0.05, 0, 3});
  const dJointID grip = dJointCreateFixed(world, nullptr);
  dJointAttach(grip, tool, last);
  dJointSetFixed(grip);
}

void controlArm(double time) {
  double begun = phase;
  for (const dJointID joint : joints) {
    const double now = 1.5 * time + begun, wanted = 0.3 * (std::sin(now) - std::sin(begun));
    const double speed = 0.45 * std::cos(now) + 10 * (wanted - double(dJointGetHingeAngle(joint)));
    dJointSetHingeParam(joint, dParamVel, dReal(speed));
    begun += 1;
  }
}

// Off by 5 cm is an error of 100 %.
std::vector<tradeoff::Observation> observeArm() {
  const Vector place = tradeoff::vectorOf(dBodyGetPosition(tool));
  return {{"x", place[0], 0.05}, {"z", place[2], 0.05}};
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "";
  tradeoff::Scene scene;
  scene.undriven = true;
  scene.build = name == "tower" ? buildTower : buildHeap;
  if (name == "tower") scene.seconds = 4;
  if (name == "arm") {
    scene.build = buildArm;
    scene.control = controlArm;
    scene.observe = observeArm;
    scene.observe_every = 1;
    scene.observe_from = 2;
    scene.seconds = 3;
    scene.rests = scene.undriven = false;
    scene.ignores = "height+spread";
  } else if (name != "tower" && name != "heap") {
    std::fprintf(stderr, "%s: which scene? arm, tower or heap\n", argv[0]);
    return 2;
  }
  return tradeoff::run(argc - 1, argv + 1, scene);
}
