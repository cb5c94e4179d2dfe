// The cheapest way to make a scene do what it owes.
#pragma once

#include <vector>

#include "play.h"

namespace sap_test {
namespace physics {

struct Way {
  std::string name;
  Setting setting;
};

// All that are tried.
const std::vector<Way>& ways();

// One start may be luck.
constexpr int kStarts = 10;

// In how many of so many starts the scene does what it owes; `all_or_none` ends with the first in
// which it does not.
int startsHeld(const Extreme& extreme, const Setting& setting, const Limits& limits,
               bool all_or_none = false);

struct Rescue {
  std::string name;  // empty: none of the ways
  double cost = 0;   // times the processor's time of the scene as ODE comes
};

// Plays the scene in all ways and takes the one that takes least time of those that hold in all
// starts. One that takes as long as the best so far is given up.
Rescue rescue(const Extreme& extreme, const Limits& limits);

}  // namespace physics
}  // namespace sap_test
