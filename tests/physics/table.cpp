// What becomes of extremes, in the precision of the ODE that it is built with; extremes.py calls
// it:
//
//     physics-table list         the names of all extremes
//     physics-table row NAME     one extreme, as two lines of CSV: names and values
//
// A row has the outcome with three kinds of pairs, whether the first and the last are the same bit
// for bit, and in how many of ten starts the scene does what it owes.
#include <cstdio>
#include <iostream>
#include <sstream>

#include "extreme.h"

namespace sap_test::physics {
namespace {

const char* const kNames =
    "precision,theme,extreme,simple,hash,ours,same_bits,held,sink,shift,creep,depth,speed,gain,"
    "lost,gap,energy,momentum,turn";

// "aborts at step 7", "stands".
std::string shown(const Result& result) {
  if (result.outcome != "not finite" && result.outcome != "aborts") return result.outcome;
  return result.outcome + " at step " + std::to_string(result.steps);
}

std::string rowOf(const Extreme& extreme) {
  const Setting as_it_comes;
  const Result simple = play(extreme, Pairing::simple_in_our_order, as_it_comes);
  const Result hash = play(extreme, Pairing::hash, as_it_comes);
  const Result ours = play(extreme, Pairing::ours, as_it_comes);
  const int held = startsHeld(extreme, as_it_comes);
  const Measures& m = ours.measures;
  std::ostringstream text;
  text << (sizeof(dReal) == 8 ? "double" : "single") << "," << extreme.theme << ",\""
       << extreme.name << "\"," << shown(simple) << "," << shown(hash) << "," << shown(ours) << ","
       << same(ours, simple) << "," << held;
  for (const double value : {m.sink, m.shift, m.creep, m.depth, m.speed, m.gain, m.lost, m.gap,
                             m.energy, m.momentum, m.turn})
    text << "," << value;
  return text.str();
}

int run(const std::string& what, const std::string& name) {
  for (const Extreme& extreme : extremes()) {
    if (what == "list") std::cout << extreme.name << "\n";
    if (what == "row" && extreme.name == name) {
      std::cout << kNames << "\n" << rowOf(extreme) << "\n";
      return 0;
    }
  }
  return what == "list" ? 0 : 2;
}

}  // namespace
}  // namespace sap_test::physics

int main(int argc, char** argv) {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  const int code = sap_test::physics::run(argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : "");
  if (code) std::cerr << "physics-table list, or row NAME\n";
  return code;
}
