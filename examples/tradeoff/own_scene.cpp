// A program that is not one of the study's scenes: a bridge of hinged planks, over which a motor
// drives a cart. What matters here is how far the bridge sags and how far the cart gets. Its study:
//
//   examples/tradeoff/run --quick --program build/release/examples/tradeoff/own-scene
#include "harness.h"

namespace {

constexpr int planks = 8;
dBodyID cart, middle;
dJointID axles[2];

dBodyID addBox(dWorldID world, dSpaceID space, double x, double z, double length, double height) {
  dMass mass;
  dMassSetBox(&mass, 600, dReal(length), 2, dReal(height));  // wood
  const dBodyID body = dBodyCreate(world);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, dReal(x), 0, dReal(z));
  dGeomSetBody(dCreateBox(space, dReal(length), 2, dReal(height)), body);
  return body;
}

dJointID addHinge(dWorldID world, dBodyID one, dBodyID other, double x, double z) {
  const dJointID hinge = dJointCreateHinge(world, nullptr);
  dJointAttach(hinge, one, other);
  dJointSetHingeAnchor(hinge, dReal(x), 0, dReal(z));
  dJointSetHingeAxis(hinge, 0, 1, 0);
  return hinge;
}

void build(dWorldID world, dSpaceID space, unsigned long seed) {
  dBodyID last = nullptr;  // the world
  for (int i = 0; i < planks; ++i) {
    const dBodyID plank = addBox(world, space, i + 0.5, 3, 0.96, 0.1);
    addHinge(world, plank, last, i, 3);
    last = plank;
    if (i == planks / 2) middle = plank;
  }
  addHinge(world, last, nullptr, planks, 3);
  cart = addBox(world, space, 1.5 + 1e-7 * double(seed * 618034 % 1000000), 3.45, 0.8, 0.2);
  for (int i = 0; i < 2; ++i) {
    const double x = double(dBodyGetPosition(cart)[0]) + (i ? 0.35 : -0.35);
    dMass mass;
    dMassSetSphere(&mass, 600, dReal(0.2));
    const dBodyID wheel = dBodyCreate(world);
    dBodySetMass(wheel, &mass);
    dBodySetPosition(wheel, dReal(x), 0, dReal(3.26));
    dGeomSetBody(dCreateSphere(space, dReal(0.2)), wheel);
    axles[i] = addHinge(world, cart, wheel, x, 3.26);
    dJointSetHingeParam(axles[i], dParamFMax, 200);
  }
}

// Drives after a second. (A hinge turns its second body against its axis.)
void control(double time) {
  for (dJointID axle : axles) dJointSetHingeParam(axle, dParamVel, time < 1 ? 0 : -4);
}

std::vector<tradeoff::Observation> observe() {
  return {{"sag", 3 - double(dBodyGetPosition(middle)[2]), 0.96},
          {"way", double(dBodyGetPosition(cart)[0]), double(planks)}};
}

}  // namespace

int main(int argc, char** argv) {
  tradeoff::Scene scene;
  scene.build = build;
  scene.control = control;
  scene.observe = observe;
  scene.seconds = 4;
  scene.rests = false;
  return tradeoff::run(argc, argv, scene);
}
