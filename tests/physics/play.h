// An extreme played in a process of its own: some end in an assertion of ODE's, a crash or no end.
#pragma once

#include "outcome.h"

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

}  // namespace physics
}  // namespace sap_test
