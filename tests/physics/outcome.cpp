#include "extreme.h"

#include <cmath>
#include <cstdio>

#include "../support/bounds.h"

namespace sap_test::physics {

namespace {

// All in units of the scene, or parts of one.
constexpr double kCollapse = 0.5;   // further than that from its place
constexpr double kSag = 0.02;       // lower, or further, than that
constexpr double kCreep = 0.002;    // in the second half
constexpr double kDepth = 0.1;      // deeper into each other
constexpr double kJitter = 0.02;    // of the speed after a fall of one unit
constexpr double kSleepless = 0.2;  // of that speed, where bodies were thrown
constexpr double kExplode = 2;      // of the energy there was, and what one unit of height holds
constexpr double kStretch = 0.05, kBreak = 0.5;  // gap of a joint
constexpr double kDrift = 0.001, kLost = 0.1;    // energy, momentum, radians

double distance(const Vec& a, const Vec& b) {
  return length(minus(a, b));
}
double square(double x) {
  return x * x;
}

// The speed at which something has fallen for one unit.
double fallSpeed(const Extreme& extreme) {
  return std::sqrt(2 * 9.81 * extreme.unit) / extreme.unit;
}

void raise(double& most, double value) {
  // A NaN is the most.
  if (!(value <= most)) most = value;
}

}  // namespace

Observer::Observer(const Extreme& extreme, const Stage& stage) : extreme_(extreme) {
  const Vec gravity = tradeoff::gravityOf(stage.world());
  for (std::size_t i = 0; i < stage.bodies().size(); ++i) {
    Body body;
    body.start = body.middle = stage.place(i);
    bodies_.push_back(body);
    energy_scale_ += tradeoff::massOf(stage[i]) * length(gravity) * extreme.unit;
  }
  energy_ = stage.energy();
  for (const dBodyID body : stage.bodies()) {
    energy_scale_ += 0.5 * square(length(vec(dBodyGetLinearVel(body))));
  }
  if (stage.bodies().empty()) return;
  momentum_ = tradeoff::spinOf(stage[0]);
  spin_ = vec(dBodyGetAngularVel(stage[0]));
}

void Observer::look(Stage& stage, int step) {
  time_ += extreme_.step;
  if (step == extreme_.steps / 2) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) bodies_[i].middle = stage.place(i);
  }
  const bool late = step >= extreme_.steps - extreme_.steps / 5 - 1;
  if (late) {
    lookLate(stage);
  } else {
    stage.depth = 0;
  }
  // Long runs are looked at now and then.
  if (extreme_.steps > 10000 && step % 100 && step != extreme_.steps - 1) return;
  if (extreme_.demand == Demand::conserve) {
    compareFree(stage);
  } else if (energy_scale_ > 0) {
    raise(measures_.gain, std::fmax(0, (stage.energy() - energy_) / energy_scale_));
  }
}

void Observer::lookLate(const Stage& stage) {
  raise(measures_.depth, stage.depth / extreme_.unit);
  for (const dBodyID body : stage.bodies()) {
    raise(measures_.speed, length(vec(dBodyGetLinearVel(body))) / extreme_.unit);
  }
  if (extreme_.demand != Demand::hold) return;
  if (extreme_.error) raise(measures_.gap, extreme_.error(stage));
  if (extreme_.error) return;
  for (const dJointID joint : stage.joints()) raise(measures_.gap, gapOf(joint) / extreme_.unit);
}

// The body turns about one of its axes at a constant rate, if it began so.
void Observer::compareFree(const Stage& stage) {
  if (energy_ != 0) measures_.energy = tradeoff::spinEnergyOf(stage[0]) / energy_ - 1;
  const double momentum = length(momentum_);
  if (momentum != 0)
    measures_.momentum = distance(tradeoff::spinOf(stage[0]), momentum_) / momentum;
  const double rate = length(spin_);
  if (rate == 0) return;
  const Vec axis = 1 / rate * spin_;
  if (distance(momentum * axis, momentum_) > 1e-3 * momentum) return;  // it tumbles
  // A direction across the axis, as it should be now and as it is.
  Vec across = cross(axis, std::fabs(axis[0]) < 0.9 ? Vec{1, 0, 0} : Vec{0, 1, 0});
  across = 1 / length(across) * across;
  const Vec third = cross(axis, across);
  dVector3 turned;
  dBodyVectorToWorld(stage[0], real(across[0]), real(across[1]), real(across[2]), turned);
  const Vec now = vec(turned);
  const double angle = std::atan2(dot(now, third), dot(now, across));
  // It drifts by far less than a turn from one look to the next.
  turned_ += std::remainder(angle - rate * time_ - turned_, 6.283185307179586);
  measures_.turn = std::fabs(turned_);
}

const Measures& Observer::end(const Stage& stage) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Vec at = stage.place(i);
    raise(measures_.shift, distance(at, bodies_[i].start) / extreme_.unit);
    raise(measures_.sink, (bodies_[i].start[2] - at[2]) / extreme_.unit);
    raise(measures_.creep, distance(at, bodies_[i].middle) / extreme_.unit);
    if (extreme_.lost(stage, i)) ++measures_.lost;
  }
  return measures_;
}

namespace {

std::string judgeRest(const Extreme& extreme, const Measures& m) {
  if (m.gain > kExplode) return "explodes";
  if (m.sink > kCollapse) return "collapses";
  if (m.shift > kCollapse) return "slides away";
  if (m.depth > kDepth) return "penetrates";
  if (m.sink > kSag) return "sags";
  if (m.shift > kSag) return "shifts";
  if (m.creep > kCreep) return "creeps";
  if (m.speed > kJitter * fallSpeed(extreme)) return "jitters";
  return "stands";
}

std::string judgeConserved(const Measures& m) {
  if (m.energy > kLost) return "gains energy";
  if (m.energy < -kLost) return "loses energy";
  const double worst = std::fmax(std::fmax(std::fabs(m.energy), m.momentum), m.turn);
  return worst > kDrift ? "drifts" : "keeps";
}

}  // namespace

std::string judge(const Extreme& extreme, const Measures& m) {
  switch (extreme.demand) {
    case Demand::stand:
      return judgeRest(extreme, m);
    case Demand::stop:
      if (m.lost > 0) return "tunnels";
      return m.gain > kExplode ? "explodes" : "stops";
    case Demand::settle:
      if (m.lost > 0) return "tunnels";
      if (m.gain > kExplode) return "explodes";
      if (m.depth > kDepth) return "penetrates";
      return m.speed > kSleepless * fallSpeed(extreme) ? "never rests" : "settles";
    case Demand::hold:
      if (m.gap > kBreak) return "breaks";
      return m.gap > kStretch ? "stretches" : "holds";
    default:
      return judgeConserved(m);
  }
}

bool isWhatItOwes(const std::string& outcome) {
  for (const char* good : {"stands", "stops", "settles", "holds", "keeps"}) {
    if (outcome == good) return true;
  }
  return false;
}

}  // namespace sap_test::physics
