// Scenes of which the answer is known: with other settings, the errors of their quantities are
// rows.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "stage.h"

namespace sap_test::physics {

// What is measured at the end of a run. The error is the difference in parts of `scale`. Without a
// scale the value says whether something happened that must not, 0 or 1.
struct Quantity {
  const char* name;
  double value, exact, scale;
};
using Quantities = std::vector<Quantity>;

// What an error must be, its mean and the worst: with settings that are checked.
struct Bound {
  const char* quantity;
  double least, mean, most = 1e300;
  bool directed = false;
};

struct Scene {
  std::string name;
  const char* of;  // what it is measured in
  std::function<Quantities(const Setting&, int run)> play;
  enum Kind { contact, friction, free, slow, swept } kind;
  int runs;
  std::vector<Bound> bounds;
};

std::vector<Scene> truthScenes();
std::vector<Scene> sweptScenes();

// In each run another part of one: no step divides these.
inline double phaseOf(int run) {
  const double golden = 0.618033988749895 * run;
  return golden - std::floor(golden);
}

}  // namespace sap_test::physics
