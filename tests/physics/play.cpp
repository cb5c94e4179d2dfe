#include <algorithm>
#include <cmath>

#include "extreme.h"

namespace sap_test::physics {

namespace {

// All in units of the scene, or parts of one.
constexpr double kCollapse = 0.5;  // further than that from its place
constexpr double kSag = 0.02;      // lower, or further, than that
constexpr double kCreep = 0.002;   // in the second half
constexpr double kDepth = 0.1;     // deeper into each other
constexpr double kJitter = 0.02;   // of the speed after a fall of one unit
constexpr double kExplode = 2;     // of the energy there was, and what one unit of height holds
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
    default:
      if (m.gap > kBreak) return "breaks";
      return m.gap > kStretch ? "stretches" : "holds";
  }
}

void raise(double& most, double value) {
  if (!(value <= most)) most = value;  // a NaN is the most
}

}  // namespace

Result play(const Extreme& whole, Pairing pairing, const Setting& setting, double part) {
  const int steps = std::max(1, static_cast<int>(whole.steps * part));
  Stage stage(pairing, setting, whole.step, whole.gravity);
  stage.add(whole.things);
  if (whole.build) whole.build(stage);
  stage.stir(1e-5 * whole.unit);

  const double unit = whole.unit, energy = stage.energy();
  const std::size_t count = stage.bodies().size();
  std::vector<Vec> start, middle;
  double energy_scale = 0;  // of all bodies that move as at the start, and fall by a unit
  for (std::size_t i = 0; i < count; ++i) {
    start.push_back(stage.place(i));
    energy_scale += tradeoff::massOf(stage[i]) * length(tradeoff::gravityOf(stage.world())) * unit +
                    dot(stage.speed(i), stage.speed(i)) / 2;
  }
  middle = start;
  Result result;
  Measures& m = result.measures;
  for (int& step = result.steps; step < steps; ++step) {
    if (whole.drive) whole.drive(stage);
    stage.step();
    result.digest = tradeoff::digestOf(stage.bodies(), result.digest);
    if (!stage.isFinite()) {
      m = {};
      return result;
    }
    if (step == steps / 2)
      for (std::size_t i = 0; i < count; ++i) middle[i] = stage.place(i);
    // Long runs are looked at now and then.
    if ((steps <= 10000 || step % 100 == 0 || step == steps - 1) && energy_scale > 0)
      raise(m.gain, std::fmax(0, (stage.energy() - energy) / energy_scale));
    if (step < steps - steps / 5 - 1) {
      stage.depth = 0;
      continue;
    }
    raise(m.depth, stage.depth / unit);
    for (std::size_t i = 0; i < count; ++i) raise(m.speed, length(stage.speed(i)) / unit);
    if (whole.error) raise(m.gap, whole.error(stage));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Vec at = stage.place(i);
    raise(m.shift, length(minus(at, start[i])) / unit);
    raise(m.sink, (start[i][2] - at[2]) / unit);
    raise(m.creep, length(minus(at, middle[i])) / unit);
    if (whole.lost && whole.lost(stage, i)) ++m.lost;
  }
  result.outcome = judge(whole, m);
  return result;
}

bool same(const Result& a, const Result& b) {
  return a.outcome == b.outcome && a.steps == b.steps && a.digest == b.digest;
}

int startsHeld(const Extreme& extreme, const Setting& setting) {
  int held = 0;
  for (unsigned start = 0; start < kStarts; ++start) {
    Setting other = setting;
    other.start = start;
    const std::string outcome = play(extreme, Pairing::ours, other).outcome;
    held += outcome == "stands" || outcome == "stops" || outcome == "holds";
  }
  return held;
}

}  // namespace sap_test::physics
