// An extreme played in a process of its own (some end in an assertion of ODE's, a crash or no end),
// and the cheapest way to make it do what it owes.
#pragma once

#include "extreme.h"

namespace sap_test {
namespace physics {

struct Result {
  std::string outcome;  // judge()'s, "not finite", "aborts", "crashes" or "too slow"
  Measures measures;
  std::uint64_t digest = 0;  // of every bit of every state of every body
  int steps = 0;             // that were made
  double seconds = 0;        // of the processor, a run
};

struct Limits {
  double seconds = 100;  // of the processor, after which a run is "too slow"
  double length = 1;     // the part of its steps that is made
  double at_least = 0;   // seconds for which runs are repeated, for a fair time
};

Result play(const Extreme& extreme, Pairing pairing, const Setting& setting, const Limits& limits);

// Whether two runs are the same, bit for bit, as far as they went.
bool same(const Result& a, const Result& b);

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
