// Chains, loaded hinges and motors.
#include <cmath>

#include "../support/bounds.h"
#include "extreme.h"

namespace sap_test {
namespace physics {

namespace {

// Links of 0.5 m along x from the origin, and a load at the end.
void chain(Stage& stage, int links, double load) {
  constexpr double length = 0.5;
  for (int i = 0; i < links; ++i) {
    stage.box({length * (i + 0.5), 0, 0}, {length, 0.1, 0.1});
    stage.ballJoint(stage[static_cast<std::size_t>(i)],
                    i ? stage[static_cast<std::size_t>(i - 1)] : nullptr, {length * i, 0, 0});
  }
  if (load == 0) return;
  stage.ball({length * links + 0.5, 0, 0}, 0.5, load * 5 / 0.5236);
  stage.ballJoint(stage.bodies().back(), stage[static_cast<std::size_t>(links - 1)],
                  {length * links, 0, 0});
}

Extreme hanging(const std::string& name, int links, double load) {
  Extreme extreme{"joints", name, Demand::hold, [=](Stage& stage) { chain(stage, links, load); }};
  extreme.unit = 0.5;
  extreme.steps = 600;
  extreme.quick = load == 1000;
  return extreme;
}

void bridge(Stage& stage) {
  constexpr int planks = 30;
  for (std::size_t i = 0; i < planks; ++i) {
    stage.box({0.5 * double(i), 0, 0}, {0.5, 2, 0.1}, 700);
    stage.hinge(stage[i], i ? stage[i - 1] : nullptr, {0.5 * double(i) - 0.25, 0, 0}, {0, 1, 0});
  }
  stage.hinge(nullptr, stage[planks - 1], {0.5 * planks - 0.25, 0, 0}, {0, 1, 0});
  stage.box({7, 0, 1}, {1, 1, 1}, 8000);
}

void door(Stage& stage) {
  stage.box({5, 0, 0}, {10, 0.1, 2}, 100);
  stage.hinge(stage[0], nullptr, {}, {0, 0, 1});
  stage.box({9.5, 0, 1.5}, {1, 1, 1}, 8000);
  const dJointID fixed = dJointCreateFixed(stage.world(), nullptr);
  dJointAttach(fixed, stage[0], stage[1]);
  dJointSetFixed(fixed);
}

void ring(Stage& stage) {
  constexpr std::size_t links = 12;
  for (std::size_t i = 0; i < links; ++i) {
    const double angle = 6.283185307179586 * double(i) / links;
    stage.box({2 * std::cos(angle), 2 * std::sin(angle), 0}, {0.3, 0.9, 0.3});
    stage.turn(i, {0, 0, 1}, angle);
  }
  for (std::size_t i = 0; i < links; ++i) {
    const double angle = 6.283185307179586 * (double(i) + 0.5) / links;
    stage.ballJoint(stage[i], stage[(i + 1) % links],
                    {2 * std::cos(angle), 2 * std::sin(angle), 0});
  }
  stage.ballJoint(stage[0], nullptr, {2.3, 0, 0});
}

// A wheel on a motor; what is wrong is a part of what the motor is set to.
Extreme motor(const char* name, double speed, double most_force, double stop) {
  Extreme extreme{"joints", name, Demand::hold, [=](Stage& stage) {
                    stage.box({0.5, 0, 0}, {1, 0.2, 0.2});
                    const dJointID joint = stage.hinge(stage[0], nullptr, {}, {0, 1, 0});
                    dJointSetHingeParam(joint, dParamVel, real(speed));
                    dJointSetHingeParam(joint, dParamFMax, real(most_force));
                    if (stop > 0) {
                      dJointSetHingeParam(joint, dParamLoStop, real(-stop));
                      dJointSetHingeParam(joint, dParamHiStop, real(stop));
                    }
                  }};
  extreme.error = [=](const Stage& stage) {
    const dJointID joint = stage.joints()[0];
    if (stop > 0) {
      return std::fmax(0, std::fabs(static_cast<double>(dJointGetHingeAngle(joint))) - stop) / stop;
    }
    return std::fabs(static_cast<double>(dJointGetHingeAngleRate(joint)) / speed - 1);
  };
  return extreme;
}

// A slider's motor that presses a box onto a fixed one; what is wrong is how far it gets into it.
Extreme press(const char* name, double force) {
  Extreme extreme{"joints", name, Demand::hold, [=](Stage& stage) {
                    for (const int side : {-1, 1}) stage.block({side * 1.001, 0, 0}, {1, 3, 3});
                    stage.box({0, 0, 0}, {1, 1, 1});
                    const dJointID joint = stage.keep(dJointCreateSlider(stage.world(), nullptr));
                    dJointAttach(joint, stage[0], nullptr);
                    dJointSetSliderAxis(joint, 1, 0, 0);
                    dJointSetSliderParam(joint, dParamVel, 1);
                    dJointSetSliderParam(joint, dParamFMax, real(force));
                  }};
  extreme.error = [](const Stage& stage) {
    return std::fmax(0, std::fabs(stage.place(0).x) - 0.001);
  };
  return extreme;
}

}  // namespace

Extremes joints() {
  Extremes extremes;
  extremes.push_back(hanging("a chain of 10 links that falls from level", 10, 0));
  extremes.push_back(hanging("a chain of 100 links that falls from level", 100, 0));
  extremes.push_back(hanging("a chain of 20 links with a load of 1000 links", 20, 1000));
  extremes.push_back(hanging("a chain of 20 links with a load of 10^6 links", 20, 1e6));
  const auto add = [&extremes](const char* name, double unit, std::function<void(Stage&)> build) {
    extremes.push_back({"joints", name, Demand::hold, std::move(build), unit});
  };
  add("a bridge of 30 planks that eight tonnes fall on", 0.5, bridge);
  add("a door of 10 m with eight tonnes at its end", 1, door);
  add("a ring of 12 links that hangs", 0.9, ring);
  extremes.push_back(motor("a motor of 10^4 rad/s that may take any force", 1e4, 1e12, 0));
  extremes.push_back(motor("a motor with 10^8 N m against its stop", 100, 1e8, 1));
  extremes.push_back(press("a slider that presses with 10^5 N", 1e5));
  extremes.push_back(press("a slider that presses with 10^9 N", 1e9));
  return extremes;
}

}  // namespace physics
}  // namespace sap_test
