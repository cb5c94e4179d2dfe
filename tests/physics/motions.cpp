// What is fast, stepped coarsely or finely, what turns, what lies long; chains, hinges and motors.
#include <cmath>

#include "../support/bounds.h"
#include "extreme.h"

namespace sap_test::physics {

namespace {

// Things that fly at a plate in the plane x = 0, from two metres away and more. There are eight of
// each, so that steps end at eight places around the plate.
constexpr int kShots = 8;

Extreme shot(const std::string& name, double thickness, std::function<void(Stage&)> shoot) {
  return {"speeds",
          name,
          Demand::stop,
          [thickness, shoot](Stage& stage) {
            stage.noGravity();
            stage.block({thickness / 2, 0, 0}, {thickness, 30, 30});
            shoot(stage);
          },
          thickness,
          60,
          [thickness](const Stage& stage, std::size_t body) {
            return stage.place(body)[0] > thickness;
          }};
}

Extreme boxAt(double speed) {
  return shot("boxes of 0.2 m at a plate of 0.1 m, " + shortNumber(speed) + " m/s", 0.1,
              [speed](Stage& stage) {
                for (int i = 0; i < kShots; ++i) {
                  const double back = speed * 0.01 * i / kShots;
                  stage.box({-2 - back, 2.0 * i - 7, 0}, {0.2, 0.2, 0.2});
                  stage.push(static_cast<std::size_t>(i), {speed, 0, 0});
                }
              });
}

void bullets(Stage& stage) {
  for (int i = 0; i < kShots; ++i) {
    stage.ball({-2 - 9.0 * i / kShots, 2.0 * i - 7, 0}, 0.005, 8000);
    stage.push(static_cast<std::size_t>(i), {900, 0, 0});
  }
}

void headOn(Stage& stage) {
  stage.noGravity();
  for (const int side : {-1, 1}) {
    stage.ball({side * 2.13, 0, 0}, 0.1);
    stage.push(stage.bodies().size() - 1, {side * -100.0, 0, 0});
  }
}

void fallForOneKilometre(Stage& stage, bool onto_plane) {
  if (onto_plane) {
    stage.plane();
  } else {
    stage.block({0, 0, -0.5}, {100, 100, 1});
  }
  stage.box({0, 0, 1000}, {1, 1, 1});
}

void marbles(Stage& stage) {
  for (const double side : {-0.505, 0.505}) {
    stage.block({side, 0, 0}, {0.01, 1.02, 1.02});
    stage.block({0, side, 0}, {1.02, 0.01, 1.02});
    stage.block({0, 0, side}, {1.02, 1.02, 0.01});
  }
  for (int i = 0; i < 64; ++i) {
    stage.ball({0.2 * (i % 4) - 0.3, 0.2 * (i / 4 % 4) - 0.3, 0.2 * (i / 16) - 0.3}, 0.01, 2500);
    const double turn = 2.4 * i, up = (i + 0.5) / 32 - 1;
    const double across = std::sqrt(1 - up * up) * 50;
    stage.push(stage.bodies().size() - 1,
               {across * std::cos(turn), across * std::sin(turn), up * 50});
  }
}

bool isOutsideBox(const Stage& stage, std::size_t body) {
  const Vec at = stage.place(body);
  return std::fmax(std::fmax(std::fabs(at[0]), std::fabs(at[1])), std::fabs(at[2])) > 0.5;
}

Extreme stackAtStep(double step, int steps) {
  Extreme extreme{"steps",
                  "a stack of 5, steps of " + shortNumber(step) + " s",
                  Demand::stand,
                  stackOnPlane(5),
                  1,
                  steps};
  extreme.step = step;
  return extreme;
}

Extreme pendulumAtStep(double step) {
  Extreme extreme{"steps",
                  "a pendulum of 1 m, steps of " + shortNumber(step) + " s",
                  Demand::hold,
                  [](Stage& stage) {
                    stage.ball({1, 0, 0}, 0.1);
                    stage.hinge(stage[0], nullptr, {}, {0, 1, 0});
                  },
                  1,
                  static_cast<int>(10 / step)};
  extreme.step = step;
  return extreme;
}

// A free body that turns, mostly for a million steps.
Extreme turning(const char* name, const Vec& sides, const Vec& speed, int steps = 1000000) {
  return {"spinning for 10^6 steps",
          name,
          Demand::conserve,
          [sides, speed](Stage& stage) {
            stage.noGravity();
            if (sides[0] > 0) {
              stage.box({}, sides);
            } else {
              stage.ball({}, 0.5);
            }
            stage.spin(0, speed);
          },
          1,
          steps};
}

void sleeping(Stage& stage) {
  dWorldSetAutoDisableFlag(stage.world(), 1);
  dWorldSetAutoDisableLinearThreshold(stage.world(), dReal(0.05));
  dWorldSetAutoDisableAngularThreshold(stage.world(), dReal(0.05));
}

// Forty stacks of three that sleep, and a ball of a tonne that rolls through them.
void storm(Stage& stage) {
  sleeping(stage);
  stage.plane();
  for (int i = 0; i < 40; ++i) stack(stage, 3, 0.5, {i % 8 * 0.6, i / 8 * 0.6, 0});
  for (std::size_t body = 0; body < 120; ++body) dBodyDisable(stage[body]);
  stage.ball({-3, 1.2, 0.6}, 0.6);
  stage.push(120, {8, 0, 0});
}

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
  return {"joints", name, Demand::hold, [=](Stage& stage) { chain(stage, links, load); }, 0.5, 600};
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
    return std::fmax(0, std::fabs(stage.place(0)[0]) - 0.001);
  };
  return extreme;
}

}  // namespace

Extremes speeds() {
  Extremes extremes;
  for (const double speed : {10, 15, 20, 25, 30, 100, 1000}) extremes.push_back(boxAt(speed));
  extremes.push_back(shot("bullets of 10 mm at a plate of 10 mm, 900 m/s", 0.01, bullets));
  extremes.push_back({"speeds", "two balls of 0.1 m head on, 100 m/s each", Demand::stop, headOn,
                      0.1, 60, [](const Stage& stage, std::size_t body) {
                        return body == 0 && stage.place(0)[0] > stage.place(1)[0];
                      }});
  for (const bool plane : {true, false})
    extremes.push_back(
        {"speeds",
         std::string("a box that falls for 1 km onto ") + (plane ? "a plane" : "a slab of 1 m"),
         Demand::settle, [plane](Stage& stage) { fallForOneKilometre(stage, plane); }, 1, 2500,
         isBelowFloor});
  extremes.push_back({"speeds", "64 marbles of 10 mm let loose at 50 m/s in a box of 10 mm walls",
                      Demand::stop, marbles, 0.01, 100, isOutsideBox});
  return extremes;
}

Extremes steps() {
  return {stackAtStep(0.0001, 20000), stackAtStep(0.001, 3000), stackAtStep(0.002, 1500),
          stackAtStep(0.005, 600),    stackAtStep(0.01, 300),   stackAtStep(0.02, 150),
          stackAtStep(0.05, 60),      stackAtStep(0.1, 60),     pendulumAtStep(0.001),
          pendulumAtStep(0.1)};
}

Extremes spins() {
  return {turning("a ball, 10 rad/s", {}, {0, 0, 10}),
          turning("a box about its longest axis, 10 rad/s", {1, 0.5, 0.2}, {10, 0, 0}),
          turning("a box about its middle axis, 10 rad/s", {1, 0.5, 0.2}, {0, 10, 0.01}),
          turning("a box about no axis of its own, 3 rad/s", {1, 0.5, 0.2}, {2, 1, 2}),
          turning("a needle of 1:1000 that tumbles, 10 rad/s", {1, 0.001, 0.001}, {1, 10, 0}),
          turning("a box about no axis of its own, 1000 rad/s, 1000 steps", {1, 0.5, 0.2},
                  {700, 300, 650}, 1000)};
}

Extremes longRuns() {
  const auto asleep = [](int count) {
    return [count](Stage& stage) {
      sleeping(stage);
      stackOnPlane(count)(stage);
    };
  };
  const auto slope = [](Stage& stage) {
    const double angle = 0.5236;
    dWorldSetGravity(stage.world(), real(-9.81 * std::sin(angle)), 0,
                     real(-9.81 * std::cos(angle)));
    stackOnPlane(1)(stage);
  };
  const auto lost = [](const Stage& stage, std::size_t body) { return stage.place(body)[2] < 0; };
  Extremes extremes = {
      {"long runs", "a box at rest for 10^6 steps", Demand::stand, stackOnPlane(1), 1, 1000000},
      {"long runs", "the same, which may sleep", Demand::stand, asleep(1), 1, 1000000},
      {"long runs", "a box on a slope of 30 degrees for 10^5 steps", Demand::stand, slope, 1,
       100000},
      {"long runs", "120 sleepers that a ball of a tonne wakes", Demand::settle, storm, 0.5, 1500,
       lost},
      {"long runs", "a stack of 10 that is woken every tenth step", Demand::stand, asleep(10), 1,
       1000}};
  extremes.back().drive = [](Stage& stage, int step) {
    for (const dBodyID body : stage.bodies())
      if (step % 10 == 0) dBodyEnable(body);
  };
  return extremes;
}

Extremes joints() {
  Extremes extremes;
  extremes.push_back(hanging("a chain of 10 links that falls from level", 10, 0));
  extremes.push_back(hanging("a chain of 100 links that falls from level", 100, 0));
  extremes.push_back(hanging("a chain of 20 links with a load of 1000 links", 20, 1000));
  extremes.push_back(hanging("a chain of 20 links with a load of 10^6 links", 20, 1e6));
  const auto add = [&extremes](const char* name, double unit, std::function<void(Stage&)> build) {
    extremes.push_back({"joints", name, Demand::hold, std::move(build), unit});
  };
  add("a ring of 12 links that hangs", 0.9, ring);
  extremes.push_back(motor("a motor of 10^4 rad/s that may take any force", 1e4, 1e12, 0));
  extremes.push_back(motor("a motor with 10^8 N m against its stop", 100, 1e8, 1));
  extremes.push_back(press("a slider that presses with 10^5 N", 1e5));
  extremes.push_back(press("a slider that presses with 10^9 N", 1e9));
  return extremes;
}

}  // namespace sap_test::physics
