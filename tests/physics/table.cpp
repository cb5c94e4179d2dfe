// What becomes of extremes, in the precision of the ODE that it is built with; extremes.py calls
// it:
//
//     physics-table list         the names of all extremes
//     physics-table row NAME     one extreme, as two lines of CSV: names and values
//     physics-table machines     in how many of ten starts each machine holds, by setting, as CSV
//
// A row has the outcome with three kinds of pairs, whether the first and the last are the same bit
// for bit, and in how many of ten starts the scene does what it owes.
#include <cstdio>
#include <iostream>
#include <sstream>
#include <utility>
#include <vector>

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

// Each setting with what its step costs, in parts of ODE's own.
void writeMachines() {
  std::vector<std::pair<const char*, Setting>> settings(6);
  settings[0].first = "as ODE comes";
  settings[1].first = "1/4 of the step";
  settings[1].second.divide = 4;
  settings[2].first = "1/16 of the step";
  settings[2].second.divide = 16;
  settings[3].first = "100 iterations";
  settings[3].second.iterations = 100;
  settings[4].first = "ERP 0.8";
  settings[4].second.erp = 0.8;
  settings[5].first = "dWorldStep";
  settings[5].second.exact = true;
  std::cout << "machine,step_s,setting,held,outcome,off,us_a_step\n";
  for (const Extreme& machine : machines())
    for (const auto& [name, setting] : settings) {
      const Result result = play(machine, Pairing::ours, setting);
      const double off =
          machine.demand == Demand::hold ? result.measures.gap : result.measures.shift;
      std::cout << '"' << machine.name << "\"," << machine.step << ",\"" << name << "\","
                << startsHeld(machine, setting) << "," << result.outcome << "," << off << ","
                << result.microseconds << std::endl;
    }
}

int run(const std::string& what, const std::string& name) {
  if (what == "machines") return writeMachines(), 0;
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
  if (code) std::cerr << "physics-table list, row NAME, or machines\n";
  return code;
}
