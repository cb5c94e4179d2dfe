#include <algorithm>
#include <cmath>

#include "extreme.h"

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

std::string judgeRest(const Measures& m, double fall_speed) {
  if (m.gain > kExplode) return "explodes";
  if (m.sink > kCollapse) return "collapses";
  if (m.shift > kCollapse) return "slides away";
  if (m.depth > kDepth) return "penetrates";
  if (m.sink > kSag) return "sags";
  if (m.shift > kSag) return "shifts";
  if (m.creep > kCreep) return "creeps";
  return m.speed > kJitter * fall_speed ? "jitters" : "stands";
}

std::string judge(const Extreme& extreme, const Measures& m) {
  // The speed at which something has fallen for one unit.
  const double fall_speed = std::sqrt(2 * kGravity * extreme.unit) / extreme.unit;
  switch (extreme.demand) {
    case Demand::stand:
      return judgeRest(m, fall_speed);
    case Demand::stop:
      if (m.lost > 0) return "tunnels";
      return m.gain > kExplode ? "explodes" : "stops";
    case Demand::settle:
      if (m.lost > 0) return "tunnels";
      if (m.gain > kExplode) return "explodes";
      if (m.depth > kDepth) return "penetrates";
      return m.speed > kSleepless * fall_speed ? "never rests" : "settles";
    default:
      if (m.gap > kBreak) return "breaks";
      return m.gap > kStretch ? "stretches" : "holds";
  }
}

// How far a joint's two anchors are apart.
double gapOf(dJointID joint) {
  dVector3 a = {}, b = {};
  if (dJointGetType(joint) == dJointTypeBall) {
    dJointGetBallAnchor(joint, a);
    dJointGetBallAnchor2(joint, b);
  } else if (dJointGetType(joint) == dJointTypeHinge) {
    dJointGetHingeAnchor(joint, a);
    dJointGetHingeAnchor2(joint, b);
  }
  return length(minus(vec(a), vec(b)));
}

double square(double x) {
  return x * x;
}
void raise(double& most, double value) {
  if (!(value <= most)) most = value;  // a NaN is the most
}

class Observer {
 public:
  // The scene as it is built.
  Observer(const Extreme& extreme, const Stage& stage) : extreme_(extreme) {
    for (std::size_t i = 0; i < stage.bodies().size(); ++i) {
      start_.push_back(stage.place(i));
      energy_scale_ +=
          tradeoff::massOf(stage[i]) * length(tradeoff::gravityOf(stage.world())) * extreme.unit;
    }
    middle_ = start_;
    energy_ = stage.energy();
    for (std::size_t i = 0; i < start_.size(); ++i)
      energy_scale_ += 0.5 * square(length(stage.speed(i)));
  }

  // After the step of this number.
  void look(Stage& stage, int step) {
    if (step == extreme_.steps / 2)
      for (std::size_t i = 0; i < start_.size(); ++i) middle_[i] = stage.place(i);
    if (step >= extreme_.steps - extreme_.steps / 5 - 1)
      lookLate(stage);
    else
      stage.depth = 0;
    // Long runs are looked at now and then.
    if (extreme_.steps > 10000 && step % 100 && step != extreme_.steps - 1) return;
    if (energy_scale_ > 0)
      raise(measures_.gain, std::fmax(0, (stage.energy() - energy_) / energy_scale_));
  }

  // After the last one.
  const Measures& end(const Stage& stage) {
    for (std::size_t i = 0; i < start_.size(); ++i) {
      const Vec at = stage.place(i);
      raise(measures_.shift, length(minus(at, start_[i])) / extreme_.unit);
      raise(measures_.sink, (start_[i][2] - at[2]) / extreme_.unit);
      raise(measures_.creep, length(minus(at, middle_[i])) / extreme_.unit);
      if (extreme_.lost && extreme_.lost(stage, i)) ++measures_.lost;
    }
    return measures_;
  }

 private:
  void lookLate(const Stage& stage) {
    raise(measures_.depth, stage.depth / extreme_.unit);
    for (std::size_t i = 0; i < start_.size(); ++i)
      raise(measures_.speed, length(stage.speed(i)) / extreme_.unit);
    if (extreme_.demand != Demand::hold) return;
    if (extreme_.error) return raise(measures_.gap, extreme_.error(stage));
    for (const dJointID joint : stage.joints()) raise(measures_.gap, gapOf(joint) / extreme_.unit);
  }

  const Extreme& extreme_;
  std::vector<Vec> start_, middle_;
  double energy_ = 0, energy_scale_ = 0;
  Measures measures_;
};

}  // namespace

Result play(const Extreme& extreme, Pairing pairing, const Setting& setting, double length) {
  Extreme part = extreme;
  part.steps = std::max(1, static_cast<int>(extreme.steps * length));
  Stage stage(pairing, setting, part.step, part.gravity);
  stage.add(part.things);
  if (part.build) part.build(stage);
  stage.stir(1e-5 * part.unit);
  Observer observer(part, stage);
  Result result;
  while (result.steps < part.steps) {
    if (part.drive) part.drive(stage);
    stage.step();
    result.digest = tradeoff::digestOf(stage.bodies(), result.digest);
    if (!stage.isFinite()) return result;
    observer.look(stage, result.steps++);
  }
  result.measures = observer.end(stage);
  result.outcome = judge(part, result.measures);
  return result;
}

bool same(const Result& a, const Result& b) {
  return a.outcome == b.outcome && a.steps == b.steps && a.digest == b.digest;
}

bool isWhatItOwes(const std::string& outcome) {
  for (const char* good : {"stands", "stops", "settles", "holds"})
    if (outcome == good) return true;
  return false;
}

int startsHeld(const Extreme& extreme, const Setting& setting) {
  int held = 0;
  for (unsigned start = 0; start < kStarts; ++start) {
    Setting other = setting;
    other.start = start;
    held += isWhatItOwes(play(extreme, Pairing::ours, other).outcome);
  }
  return held;
}

}  // namespace sap_test::physics
