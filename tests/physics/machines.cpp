// Machines and structures that are ordinary, and hard for a solver: what each needs to hold.
#include <cmath>

#include "../support/bounds.h"
#include "extreme.h"

namespace sap_test::physics {

namespace {

constexpr double kPi = 3.14159265358979323846;

void drive(dJointID hinge, double torque) {
  dJointSetHingeParam(hinge, dParamFMax, real(torque));
  dJointSetHingeParam(hinge, dParamVel, 0);
}

// All motors pull their hinges back to where these were built.
void holdStill(Stage& stage, int) {
  for (const dJointID joint : stage.joints())
    if (dJointGetType(joint) == dJointTypeHinge && dJointGetHingeParam(joint, dParamFMax) > 0)
      dJointSetHingeParam(joint, dParamVel, -20 * dJointGetHingeAngle(joint));
}

double drop(const Stage& stage, std::size_t body, double height) {
  return std::fabs(stage.place(body)[2] - height);
}

// Wedges of stone from one foot to the other of a half circle of 2 m.
void arch(Stage& stage) {
  constexpr int count = 9;
  constexpr double inner = 0.85, outer = 1.15, half = 0.15;
  stage.plane();
  for (const int side : {-1, 1}) stage.block({side * 1.65, 0, 0.25}, {1, 1, 0.5});
  for (int i = 0; i < count; ++i) {
    const double middle = kPi * (i + 0.5) / count, turn = kPi / count / 2;
    std::vector<Vec> corners;
    for (const double radius : {inner, outer})
      for (const int side : {-1, 1})
        for (const int y : {-1, 1})
          corners.push_back(
              {radius * std::sin(side * turn), y * half, radius * std::cos(turn) - std::cos(turn)});
    const Vec place = {std::cos(middle) * std::cos(turn), 0, std::sin(middle) * std::cos(turn)};
    stage.wedge(corners, place, 2500);
    stage.turn(std::size_t(i), {0, 1, 0}, kPi / 2 - middle);
  }
}

void boards(Stage& stage) {
  stage.plane();
  for (int i = 0; i < 10; ++i) stage.box({0, 0, 0.01 * (i + 0.5)}, {0.5, 0.3, 0.01}, 700);
}

// A disc of 0.2 m at 100 rad/s on a pivot 0.2 m beside it. Its axis goes round, level.
void gyroscope(Stage& stage) {
  dMass mass;
  dMassSetCylinder(&mass, 1000, 1, real(0.2), real(0.05));
  const dBodyID disc = stage.body(nullptr, mass, {0.2, 0, 1});
  stage.ballJoint(disc, nullptr, {0, 0, 1});
  const double around = double(mass.mass) * 9.81 * 0.2 / (double(mass.I[0]) * 100);
  stage.spin(0, {100, 0, around});
  stage.push(0, {0, 0.2 * around, 0});
}

// A door of 80 kg that swings into its stop at 2 rad/s, and is to stay there.
void door(Stage& stage) {
  stage.noGravity();
  stage.box({0.45, 0, 1}, {0.9, 0.04, 2}, 80 / 0.072);
  const dJointID hinge = stage.hinge(stage[0], nullptr, {0, 0, 1}, {0, 0, 1});
  dJointSetHingeParam(hinge, dParamLoStop, real(-0.2));
  dJointSetHingeParam(hinge, dParamHiStop, real(0.2));
  stage.push(0, {0, 0.9, 0});
  stage.spin(0, {0, 0, 2});
}

// Links of 2 kg and 0.3 m on motors, from a base that stands on the floor.
void mobileArm(Stage& stage) {
  stage.plane();
  const dBodyID base = stage.box({0, 0, 0.2}, {0.8, 0.6, 0.4}, 50 / 0.192);
  dBodyID last = base;
  for (int i = 0; i < 4; ++i) {
    const dBodyID link = stage.box({0.45 + 0.3 * i, 0, 0.5}, {0.28, 0.06, 0.06}, 2 / 0.001008);
    drive(stage.hinge(link, last, {0.3 + 0.3 * i, 0, 0.5}, {0, 1, 0}), 1e4);
    last = link;
  }
}

// Two fingers on sliders hold a box of 2 kg by friction; their motors control positions.
void gripper(Stage& stage) {
  stage.box({0, 0, 1}, {0.1, 0.1, 0.1}, 2000);
  for (const int side : {-1, 1}) {
    const dBodyID finger = stage.box({side * 0.06, 0, 1}, {0.02, 0.05, 0.1}, 5000);
    const dJointID slider = stage.keep(dJointCreateSlider(stage.world(), nullptr));
    dJointAttach(slider, finger, nullptr);
    dJointSetSliderAxis(slider, real(side), 0, 0);
    dJointSetSliderParam(slider, dParamFMax, 100);
  }
}

// 70 kg that stand on two feet, hinges held by motors.
void humanoid(Stage& stage) {
  stage.plane();
  const auto held = [&](dBodyID a, dBodyID b, const Vec& anchor) {
    drive(stage.hinge(a, b, anchor, {0, 1, 0}), 6e4);
  };
  const auto box = [&](double kg, const Vec& sides, const Vec& centre) {
    return stage.box(centre, sides, kg / (sides[0] * sides[1] * sides[2]));
  };
  const dBodyID torso = box(45, {0.2, 0.35, 0.6}, {0, 0, 1.23});
  for (const double y : {-0.11, 0.11}) {
    const dBodyID thigh = box(7, {0.12, 0.12, 0.4}, {0, y, 0.72});
    const dBodyID shin = box(3.5, {0.09, 0.09, 0.4}, {0, y, 0.3});
    const dBodyID foot = box(1.05, {0.26, 0.1, 0.06}, {0.04, y, 0.03});
    held(thigh, torso, {0, y, 0.93});
    held(shin, thigh, {0, y, 0.51});
    held(foot, shin, {0, y, 0.08});
  }
}

}  // namespace

Extremes machines() {
  Extremes all;
  const auto add = [&](const char* name, Demand demand, std::function<void(Stage&)> build,
                       double unit, int steps) -> Extreme& {
    all.push_back({"machines", name, demand, std::move(build), unit, steps});
    return all.back();
  };
  add("an arch of nine wedges, 2 m", Demand::stand, arch, 0.3, 300);
  add("ten boards of 10 mm one on the other", Demand::stand, boards, 0.01, 300);
  add("a gyroscope of 6 kg on a pivot, 100 rad/s", Demand::hold, gyroscope, 0.2, 200).error =
      [](const Stage& stage) { return drop(stage, 0, 1) / 0.2; };
  add("a door of 80 kg at its stop, 2 rad/s", Demand::hold, door, 1, 200).error =
      [](const Stage& stage) {
        return std::fabs(std::fabs(double(dJointGetHingeAngle(stage.joints()[0]))) - 0.2);
      };
  Extreme& arm = add("an arm of four links on a mobile base", Demand::hold, mobileArm, 1.2, 300);
  arm.error = [](const Stage& stage) { return drop(stage, 4, 0.5) / 1.2; };
  Extreme& grip = add("a gripper with position control", Demand::hold, gripper, 0.1, 300);
  grip.error = [](const Stage& stage) { return drop(stage, 0, 1) / 0.1; };
  grip.drive = [](Stage& stage, int) {  // to 2 mm within the box
    for (const dJointID joint : stage.joints())
      dJointSetSliderParam(joint, dParamVel, 20 * (real(-0.002) - dJointGetSliderPosition(joint)));
  };
  Extreme& man = add("a humanoid of 70 kg that stands", Demand::hold, humanoid, 1, 400);
  man.error = [](const Stage& stage) { return drop(stage, 0, 1.23); };
  man.step = 0.005;
  arm.drive = man.drive = holdStill;
  return all;
}

}  // namespace sap_test::physics
