// Scenes at an extreme of physics, and what should become of each.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "../support/floating_point.h"
#include "stage.h"

namespace sap_test {
namespace physics {

// What a scene owes, by which its outcome is judged (outcome.h).
enum class Demand {
  stand,    // is at rest as it is built, and stays so
  stop,     // something fast does not get through something thin
  settle,   // comes to rest, whatever was wrong at the start
  hold,     // joints stay together, motors and stops do what they are set to
  conserve  // energy, angular momentum and the turn of a free body
};

// For names: 0.001 and 1e+06.
std::string shortNumber(double number);

struct Extreme {
  const char* theme;
  std::string name;
  Demand demand;
  std::function<void(Stage&)> build;
  double unit = 1;  // metres: what drift, depth and speed are measured by
  double step = 0.01;
  int steps = 300;
  // Called before each step.
  std::function<void(Stage&, int step)> drive = [](Stage&, int) {};
  // Whether a body is where nothing lets it come to.
  std::function<bool(const Stage&, std::size_t body)> lost = [](const Stage&, std::size_t) {
    return false;
  };
  // For Demand::hold: what is wrong, 1 being all of it. As it is, the widest gap of a joint.
  std::function<double(const Stage&)> error = nullptr;
  bool quick = false;  // in the part of the suite that CTest plays
  unsigned mode = FloatingPointMode::kDefault;
};

using Extremes = std::vector<Extreme>;

// All of them, by theme.
const Extremes& extremes();

Extremes masses();
Extremes structures();
Extremes speeds();
Extremes steps();
Extremes sizes();
Extremes places();
Extremes overlaps();
Extremes shapes();
Extremes joints();
Extremes spins();
Extremes longRuns();
Extremes modes();

// `count` boxes one on the other, from z = `height` on.
void stack(Stage& stage, int count, double side, const Vec& foot = {}, double density = 1000);

}  // namespace physics
}  // namespace sap_test
