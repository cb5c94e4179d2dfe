#include "rescue.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace sap_test {
namespace physics {

namespace {

Setting quick(int iterations, int divide = 1) {
  Setting setting;
  setting.iterations = iterations;
  setting.divide = divide;
  return setting;
}

Setting exact(int divide = 1) {
  Setting setting;
  setting.exact = true;
  setting.divide = divide;
  return setting;
}

Setting with(Setting setting, double erp, double cfm) {
  setting.erp = erp;
  setting.cfm = cfm;
  return setting;
}

std::string times(int divide) {
  return divide == 1 ? ""
                     : (divide == 2 ? "half the step" : "a step of 1/" + std::to_string(divide));
}

std::string join(const std::string& a, const std::string& b) {
  return a.empty() || b.empty() ? a + b : a + ", " + b;
}

// What is set in a world, or of its bodies, without more work for the solver.
void addSettings(std::vector<Way>& ways) {
  const double soft = 1e-5;
  ways.push_back({"ERP 0.8", with(quick(20), 0.8, kOdesCfm)});
  ways.push_back({"ERP 0.05", with(quick(20), 0.05, kOdesCfm)});
  ways.push_back({"CFM 0", with(quick(20), 0.2, 0)});
  ways.push_back({"CFM 1e-5", with(quick(20), 0.2, soft)});
  ways.push_back({"ERP 0.8, CFM 1e-5", with(quick(20), 0.8, soft)});
  for (const double speed : {10.0, 1.0, 0.1}) {
    Setting setting;
    setting.correction = speed;
    char name[64];
    std::snprintf(name, sizeof name, "correcting velocity of %g m/s", speed);
    ways.push_back({name, setting});
  }
  Setting damped, finite;
  damped.damping = 0.01;
  ways.push_back({"damping of 0.01", damped});
  finite.finite_rotation = true;
  ways.push_back({"finite rotations", finite});
}

}  // namespace

const std::vector<Way>& ways() {
  static const std::vector<Way> all = [] {
    std::vector<Way> ways;
    addSettings(ways);
    for (const int divide : {1, 2, 4, 10, 100}) {
      for (const int iterations : {20, 50, 100, 300, 1000}) {
        if (divide == 1 && iterations == 20) continue;
        if (divide >= 10 && iterations > 100) continue;
        const std::string many = iterations == 20 ? "" : std::to_string(iterations) + " iterations";
        ways.push_back({join(many, times(divide)), quick(iterations, divide)});
      }
      ways.push_back({join("dWorldStep", times(divide)), exact(divide)});
      ways.push_back({join("dWorldStep, CFM 1e-5", times(divide)), with(exact(divide), 0.2, 1e-5)});
    }
    ways.push_back({"ERP 0.8, 100 iterations", with(quick(100), 0.8, kOdesCfm)});
    ways.push_back({"ERP 0.8, 100 iterations, a step of 1/4", with(quick(100, 4), 0.8, kOdesCfm)});
    return ways;
  }();
  return all;
}

namespace {

// Short runs are repeated, which takes the clock's ticks of some ms and the start of a process out.
double secondsOf(const Extreme& extreme, const Setting& setting, Limits limits) {
  limits.at_least = 0.1;
  return play(extreme, Pairing::ours, setting, limits).seconds;
}

// Whether it is at least as much work in every way.
bool takesAsLong(const Setting& setting, const Setting& other) {
  return setting.exact == other.exact && setting.divide >= other.divide &&
         (setting.exact || setting.iterations >= other.iterations);
}

}  // namespace

int startsHeld(const Extreme& extreme, const Setting& setting, const Limits& limits,
               bool all_or_none) {
  int held = 0;
  for (unsigned start = 0; start < kStarts; ++start) {
    Setting other = setting;
    other.start = start;
    const bool holds = isWhatItOwes(play(extreme, Pairing::ours, other, limits).outcome);
    held += holds;
    if (!holds && all_or_none) return 0;
  }
  return held;
}

Rescue rescue(const Extreme& extreme, const Limits& limits) {
  Rescue best;
  const double as_it_comes = secondsOf(extreme, {}, limits);
  double least = limits.seconds;
  std::vector<Setting> too_slow;
  for (const Way& way : ways()) {
    if (std::any_of(too_slow.begin(), too_slow.end(),
                    [&way](const Setting& slow) { return takesAsLong(way.setting, slow); })) {
      continue;
    }
    Limits left = limits;
    left.seconds = std::fmin(limits.seconds, 2 * least + 0.1);
    const Result result = play(extreme, Pairing::ours, way.setting, left);
    if (result.outcome == "too slow") too_slow.push_back(way.setting);
    if (!isWhatItOwes(result.outcome)) continue;
    const double seconds = secondsOf(extreme, way.setting, left);
    if (seconds >= least || startsHeld(extreme, way.setting, left, true) < kStarts) continue;
    least = seconds;
    best.name = way.name;
    best.cost = seconds / as_it_comes;
  }
  return best;
}

}  // namespace physics
}  // namespace sap_test
