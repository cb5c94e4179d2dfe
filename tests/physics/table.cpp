// What becomes of every extreme, with whose pairs, and what would rescue it:
//
//     physics-table README.md [results.csv [part of a name]]
//
// plays all of them, or those of such names, in the precision of the ODE that it is built with, on
// all cores, and replaces what README.md has between <!-- table double --> (or single) and <!-- end
// -->. Ends with 1 if an outcome of dParallelSAPSpace is not, bit for bit, that of dSimpleSpace's
// pairs in the same order.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "rescue.h"

namespace sap_test {
namespace physics {
namespace {

const char* const kPrecision = sizeof(dReal) == 8 ? "double" : "single";

// Of the processor, a run: stacks of 100 at 20 iterations take 0.2.
constexpr double kRescueSeconds = 3;

struct Row {
  const Extreme* extreme;
  Result simple, hash, ours;
  Rescue rescue;
};

Row rowOf(const Extreme& extreme) {
  const Setting as_it_comes;
  const Limits limits;
  Row row = {&extreme,
             play(extreme, Pairing::simple_in_our_order, as_it_comes, limits),
             play(extreme, Pairing::hash, as_it_comes, limits),
             play(extreme, Pairing::ours, as_it_comes, limits),
             {}};
  Limits for_rescue;
  for_rescue.seconds = kRescueSeconds;
  if (!isWhatItOwes(row.ours.outcome)) row.rescue = rescue(extreme, for_rescue);
  return row;
}

std::string rescueOf(const Row& row) {
  if (isWhatItOwes(row.ours.outcome)) return "";
  if (row.rescue.name.empty()) return "none of these";
  char cost[32];
  std::snprintf(cost, sizeof cost, " (%.2g×)", row.rescue.cost);
  return row.rescue.name + cost;
}

std::string shown(const Result& result) {
  if (result.outcome != "not finite" && result.outcome != "aborts") return result.outcome;
  return result.outcome + " at step " + std::to_string(result.steps);
}

std::string markdown(const std::vector<Row>& rows) {
  std::ostringstream text;
  text << "| | dSimpleSpace, our order | dHashSpace | dParallelSAPSpace | the same bits | "
          "of ours | cheapest rescue |\n| --- | --- | --- | --- | --- | --- | --- |\n";
  std::string theme;
  for (const Row& row : rows) {
    const Extreme& extreme = *row.extreme;
    if (theme != extreme.theme) {
      text << "| **" << (theme = extreme.theme) << "** | | | | | | |\n";
    }
    text << "| " << extreme.name << " | " << shown(row.simple) << " | " << shown(row.hash) << " | "
         << shown(row.ours) << " | " << (same(row.ours, row.simple) ? "yes" : "NO") << " | "
         << figures(extreme, row.ours.measures) << " | " << rescueOf(row) << " |\n";
  }
  return text.str();
}

std::string csv(const std::vector<Row>& rows) {
  std::ostringstream text;
  text << "precision,theme,extreme,simple,hash,ours,same_bits,sink,shift,creep,depth,speed,gain,"
          "lost,gap,energy,momentum,turn,rescue,rescue_cost\n";
  for (const Row& row : rows) {
    const Measures& m = row.ours.measures;
    text << kPrecision << "," << row.extreme->theme << ",\"" << row.extreme->name << "\","
         << row.simple.outcome << "," << row.hash.outcome << "," << row.ours.outcome << ","
         << same(row.ours, row.simple);
    for (const double figure : {m.sink, m.shift, m.creep, m.depth, m.speed, m.gain, m.lost, m.gap,
                                m.energy, m.momentum, m.turn}) {
      text << "," << figure;
    }
    text << ",\"" << row.rescue.name << "\"," << row.rescue.cost << "\n";
  }
  return text.str();
}

void replaceIn(const std::string& file, const std::string& table) {
  std::stringstream old;
  old << std::ifstream(file).rdbuf();
  const std::string text = old.str(), begin = "<!-- table " + std::string(kPrecision) + " -->\n",
                    end = "<!-- end -->\n";
  const std::size_t from = text.find(begin), to = text.find(end, from);
  if (from == std::string::npos || to == std::string::npos) {
    throw std::runtime_error(file + " has no " + begin + " and " + end);
  }
  std::ofstream(file) << text.substr(0, from) << begin << "\n" << table << "\n" << text.substr(to);
}

void tell(const Row& row) {
  std::ostringstream line;
  line << row.extreme->theme << ": " << row.extreme->name << ": " << row.simple.outcome << ", "
       << row.hash.outcome << ", " << row.ours.outcome << " ("
       << figures(*row.extreme, row.ours.measures) << ")"
       << (same(row.ours, row.simple) ? "" : ", NOT THE SAME") << "; " << rescueOf(row) << " ["
       << row.ours.seconds << " s]\n";
  std::cerr << line.str() << std::flush;
}

// A thread a core, each of which takes the next extreme until there is none.
std::vector<Row> allRows(const std::string& part) {
  std::vector<const Extreme*> chosen;
  for (const Extreme& extreme : extremes()) {
    if (extreme.name.find(part) != std::string::npos) chosen.push_back(&extreme);
  }
  std::vector<Row> rows(chosen.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&rows, &chosen, &next] {
    dAllocateODEDataForThread(dAllocateMaskAll);
    for (std::size_t i; (i = next++) < rows.size();) {
      rows[i] = rowOf(*chosen[i]);
      tell(rows[i]);
    }
    dCleanupODEAllDataForThread();
  };
  std::vector<std::thread> threads;
  for (unsigned i = std::max(1u, std::thread::hardware_concurrency()); i > 0; --i) {
    threads.emplace_back(work);
  }
  for (std::thread& thread : threads) thread.join();
  return rows;
}

int run(int argc, char** argv) {
  const std::vector<Row> rows = allRows(argc > 3 ? argv[3] : "");
  if (argc > 1 && *argv[1]) {
    replaceIn(argv[1], markdown(rows));
  } else {
    std::cout << markdown(rows);
  }
  if (argc > 2 && *argv[2]) std::ofstream(argv[2]) << csv(rows);
  for (const Row& row : rows) {
    if (!same(row.ours, row.simple)) return 1;
  }
  return 0;
}

}  // namespace
}  // namespace physics
}  // namespace sap_test

int main(int argc, char** argv) try {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  return sap_test::physics::run(argc, argv);
} catch (const std::exception& problem) {
  std::cerr << argv[0] << ": " << problem.what() << "\n";
  return 2;
}
