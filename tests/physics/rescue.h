// The cheapest way to make a scene do what it owes.
#pragma once

#include <functional>
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

struct Rescue {
  std::string name;               // empty: none of the ways
  double cost = 0;                // times the processor's time of the scene as ODE comes
  bool looked_everywhere = true;  // false where it was to stop
};

// Plays the scene in all ways and takes the one that takes least time. One that takes as long as
// the best so far is given up. Is asked before each whether to stop.
Rescue rescue(
    const Extreme& extreme, const Limits& limits,
    const std::function<bool()>& stop = [] { return false; });

}  // namespace physics
}  // namespace sap_test
