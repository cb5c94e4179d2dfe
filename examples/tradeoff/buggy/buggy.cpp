// ODE's demo_buggy, studied: demo_buggy.sed changes the demo's source where it built a world,
// stepped it and made contacts; this says what matters in it. It drives up a ramp and over its
// edge. README.md, "A program that is not ours", walks through.
#include "../harness.h"
#include "demo_buggy_parts.h"

namespace {

constexpr double step = 0.05;  // of the demo, to which its springs belong

// The same spring and damper with another step: ODE's manual, "How to use ERP and CFM".
struct Spring {
  double erp, cfm;
  Spring with(double dt) const {
    const double stiffness = erp / (cfm * step), damping = (1 - erp) / cfm;
    const double both = dt * stiffness + damping;
    return {dt * stiffness / both, 1 / both};
  }
};

Spring tyre;  // with the step of the study

// Chance moves the ramp.
void buildWith(dWorldID given_world, dSpaceID given_space, unsigned long seed) {
  build(given_world, given_space);
  const dReal* place = dGeomGetPosition(ground_box);
  const double chance = 0.2e-6 * static_cast<double>(seed * 618034 % 1000000);  // metres
  dGeomSetPosition(ground_box, place[0] + dReal(chance), place[1], place[2]);
}

void prepare(double dt) {
  const Spring suspension = Spring{0.4, 0.8}.with(dt);
  for (const dJointID one : joint) {
    dJointSetHinge2Param(one, dParamSuspensionERP, dReal(suspension.erp));
    dJointSetHinge2Param(one, dParamSuspensionCFM, dReal(suspension.cfm));
  }
  tyre = Spring{0.5, 0.3}.with(dt);
}

bool surfaceWith(dContact& contact) {
  if (!surface(contact)) return false;
  contact.surface.soft_erp = dReal(tyre.erp);
  contact.surface.soft_cfm = dReal(tyre.cfm);
  return true;
}

// The keys of the demo's user: faster, and a little to the left.
void control(double time) {
  speed = time < 1 ? 0 : 6;
  steer = time < 4 ? 0 : dReal(-0.2);
  simLoop(0);
}

// Off by the chassis' length is an error of 100 %.
std::vector<tradeoff::Observation> observe() {
  const dReal* place = dBodyGetPosition(body[0]);
  return {{"way", double(place[0]), LENGTH}, {"aside", double(place[1]), LENGTH}};
}

}  // namespace

int main(int argc, char** argv) {
  tradeoff::Scene scene;
  scene.build = buildWith;
  scene.prepare = prepare;
  scene.control = control;
  scene.surface = surfaceWith;
  scene.observe = observe;
  scene.seconds = 12;
  scene.rests = false;
  return tradeoff::run(argc, argv, scene);
}
