// Boxes as plain arrays with the pairs they owe, for the tests of the parts that find them.
#pragma once

#include <algorithm>
#include <vector>

#include "catch.hpp"
#include "knobs.h"
#include "random.h"
#include "scenes.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Boxes, filters and their pairs by the formula, in the order of the report.
struct Case {
  BoxSet boxes;
  std::vector<Pair> exact;  // by the exact bounds
};

Case makeCase(const std::vector<sap_test::Box>& scene, bool wide, bool filtered);

std::vector<Pair> joined(const PairList& list);
std::vector<Pair> found(PairFinder& finder, const BoxSet& boxes, int threads, PairList& list);

// Every pair owed is there; those beyond it are borderline; all are ascending.
void check(const std::vector<Pair>& got, const Case& wanted);

// Runs that are said to be decided have no borderline pair.
void checkDecidedRuns(const PairList& list);

}  // namespace ode_parallel_sap
