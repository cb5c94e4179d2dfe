// The extremes and the machines, as rows of things; joints, meshes and drives beside them.
#include <cmath>

#include "extreme.h"

namespace sap_test::physics {

namespace {

const Thing kFloor = {Thing::plane};

// So many in a row.
Thing row(int count, const Vec& next, Thing thing) {
  thing.count = count;
  thing.next = next;
  return thing;
}

// Boxes one on the other.
Thing stack(int count, double side = 1, const Vec& foot = {}, double density = 1000) {
  return row(count, {0, 0, side}, {Thing::box, foot, {side, side, side}, density});
}

Extremes all;

Extreme& add(const char* theme, const std::string& name, Demand demand, const Things& things,
             double unit = 1, int steps = 300) {
  return all.emplace_back(Extreme{theme, name, demand, things, unit, steps});
}

void loads() {
  for (const std::string ratio : {"3", "10", "30", "10^2", "10^4", "10^6"}) {
    const double upper = ratio.size() < 4 ? std::stod(ratio) : std::pow(10.0, ratio[3] - '0');
    add("mass ratios", "a box on one as large, 1:" + ratio + " of its mass", Demand::stand,
        {kFloor, stack(1), stack(1, 1, {0, 0, 1}, 1000 * upper)});
  }
  for (const int count : {3, 5, 7, 10, 20, 100})
    add("structures", "a stack of " + std::to_string(count), Demand::stand, {kFloor, stack(count)});
}

// Boxes that fly at a plate in the plane x = 0, from two metres away and more: steps end at eight
// places around it.
void speeds() {
  constexpr double thickness = 0.1;
  for (const double speed : {10, 15, 20, 30, 100, 1000}) {
    Things things = {{Thing::fixed, {thickness / 2, 0, 0}, {thickness, 30, 30}}};
    for (int i = 0; i < 8; ++i)
      things.push_back({Thing::box,
                        {-2 - speed * 0.01 * i / 8, 2.0 * i - 7, 0},
                        {0.2, 0.2, 0.2},
                        1000,
                        {speed, 0, 0}});
    Extreme& extreme = add("speeds", "boxes of 0.2 m at a plate of 0.1 m, " + text(speed) + " m/s",
                           Demand::stop, things, thickness, 60);
    extreme.gravity = {};
    extreme.lost = [](const Stage& stage, std::size_t body) {
      return stage.place(body)[0] > thickness;
    };
  }
}

void steps() {
  const double lengths[] = {0.0001, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1};
  const int counts[] = {20000, 3000, 1500, 600, 300, 150, 60, 60};
  for (int i = 0; i < 8; ++i)
    add("steps", "a stack of 5, steps of " + text(lengths[i]) + " s", Demand::stand,
        {kFloor, stack(5)}, 1, counts[i])
        .step = lengths[i];
}

void drive(dJointID hinge, double speed, double torque) {
  dJointSetHingeParam(hinge, dParamVel, real(speed));
  dJointSetHingeParam(hinge, dParamFMax, real(torque));
}

// All motors pull their hinges back to where these were built.
void holdStill(Stage& stage) {
  for (const dJointID joint : stage.joints())
    dJointSetHingeParam(joint, dParamVel, -20 * dJointGetHingeAngle(joint));
}

// How far a body is above or below a height.
std::function<double(const Stage&)> off(std::size_t body, double height, double unit) {
  return [=](const Stage& stage) { return std::fabs(stage.place(body)[2] - height) / unit; };
}

// Wedges of stone from one foot to the other of a half circle of 2 m.
void arch(Stage& stage) {
  constexpr int count = 9;
  constexpr double inner = 0.85, outer = 1.15, half = 0.15;
  for (int i = 0; i < count; ++i) {
    const double middle = kPi * (i + 0.5) / count, turn = kPi / count / 2;
    std::vector<Vec> corners;
    for (const double radius : {inner, outer})
      for (const int side : {-1, 1})
        for (const int y : {-1, 1})
          corners.push_back(
              {radius * std::sin(side * turn), y * half, radius * std::cos(turn) - std::cos(turn)});
    stage.wedge(corners, {std::cos(middle) * std::cos(turn), 0, std::sin(middle) * std::cos(turn)},
                2500);
    stage.turn(std::size_t(i), {0, 1, 0}, kPi / 2 - middle);
  }
}

// A disc of 0.2 m at 100 rad/s on a pivot 0.2 m beside it. Its axis goes round, level.
void gyroscope(Stage& stage) {
  dMass mass;
  dMassSetCylinder(&mass, 1000, 1, real(0.2), real(0.05));
  stage.ballJoint(stage.body(nullptr, mass, {0.2, 0, 1}), nullptr, {0, 0, 1});
  const double around = double(mass.mass) * kGravity * 0.2 / (double(mass.I[0]) * 100);
  stage.spin(0, {100, 0, around});
  stage.push(0, {0, 0.2 * around, 0});
}

// Links of 2 kg and 0.3 m on motors.
void mobileArm(Stage& stage) {
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = 0.3 * double(i);
    stage.add({Thing::box, {0.45 + x, 0, 0.5}, {0.28, 0.06, 0.06}, 2 / 0.001008});
    drive(stage.hinge(stage[i + 1], stage[i], {0.3 + x, 0, 0.5}, {0, 1, 0}), 0, 1e4);
  }
}

// 70 kg that stand on two feet, hinges held by motors.
void humanoid(Stage& stage) {
  const auto box = [&](double kg, const Vec& sides, const Vec& centre) {
    return stage.add({Thing::box, centre, sides, kg / (sides[0] * sides[1] * sides[2])});
  };
  const auto held = [&](dBodyID a, dBodyID b, const Vec& anchor) {
    drive(stage.hinge(a, b, anchor, {0, 1, 0}), 0, 6e4);
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

void buildMachines() {
  const auto machine = [](const char* name, Demand demand, double unit, const Things& things,
                          std::function<void(Stage&)> build = nullptr,
                          int steps = 300) -> Extreme& {
    Extreme& extreme = add("machines", name, demand, things, unit, steps);
    extreme.build = build;
    return extreme;
  };
  const auto pillar = [](double x) { return Thing{Thing::fixed, {x, 0, 0.25}, {1, 1, 0.5}}; };
  machine("an arch of nine wedges, 2 m", Demand::stand, 0.3, {kFloor, pillar(-1.65), pillar(1.65)},
          arch);
  machine("ten boards of 10 mm one on the other", Demand::stand, 0.01,
          {kFloor, row(10, {0, 0, 0.01}, {Thing::box, {}, {0.5, 0.3, 0.01}, 700})});
  machine("a gyroscope of 6 kg on a pivot, 100 rad/s", Demand::hold, 0.2, {}, gyroscope, 200)
      .error = off(0, 1, 0.2);
  Extreme& door = machine(
      "a door of 80 kg at its stop, 2 rad/s", Demand::hold, 1,
      {{Thing::box, {0.45, 0, 1}, {0.9, 0.04, 2}, 80 / 0.072, {0, 0.9, 0}, {0, 0, 2}}},
      [](Stage& stage) {
        const dJointID hinge = stage.hinge(stage[0], nullptr, {0, 0, 1}, {0, 0, 1});
        dJointSetHingeParam(hinge, dParamLoStop, real(-0.2));
        dJointSetHingeParam(hinge, dParamHiStop, real(0.2));
      },
      200);
  door.gravity = {};
  door.error = [](const Stage& stage) {
    return std::fabs(std::fabs(double(dJointGetHingeAngle(stage.joints()[0]))) - 0.2);
  };
  Extreme& arm =
      machine("an arm of four links on a mobile base", Demand::hold, 1.2,
              {kFloor, {Thing::box, {0, 0, 0.2}, {0.8, 0.6, 0.4}, 50 / 0.192}}, mobileArm);
  arm.error = off(4, 0.5, 1.2);
  arm.drive = holdStill;
  const auto finger = [](double x) {
    return Thing{Thing::box, {x, 0, 1}, {0.02, 0.05, 0.1}, 5000};
  };
  Extreme& grip =
      machine("a gripper with position control", Demand::hold, 0.1,
              {{Thing::box, {0, 0, 1}, {0.1, 0.1, 0.1}, 2000}, finger(-0.06), finger(0.06)},
              [](Stage& stage) {
                for (std::size_t i = 1; i < 3; ++i) {
                  const dJointID slider =
                      stage.keep(dJointCreateSlider(stage.world(), nullptr), stage[i], nullptr);
                  dJointSetSliderAxis(slider, i == 1 ? -1 : 1, 0, 0);
                  dJointSetSliderParam(slider, dParamFMax, 100);
                }
              });
  grip.error = off(0, 1, 0.1);
  grip.drive = [](Stage& stage) {  // to 2 mm within the box
    for (const dJointID joint : stage.joints())
      dJointSetSliderParam(joint, dParamVel, 20 * (real(-0.002) - dJointGetSliderPosition(joint)));
  };
  Extreme& man =
      machine("a humanoid of 70 kg that stands", Demand::hold, 1, {kFloor}, humanoid, 400);
  man.error = off(0, 1.23, 1);
  man.step = 0.005;
  man.drive = holdStill;
}

// All that a function adds.
Extremes allOf(std::initializer_list<void (*)()> themes) {
  all.clear();
  for (const auto& theme : themes) theme();
  return std::move(all);
}

}  // namespace

const Extremes& extremes() {
  static const Extremes found = allOf({loads, speeds, steps});
  return found;
}

Extremes machines() {
  return allOf({buildMachines});
}

}  // namespace sap_test::physics
