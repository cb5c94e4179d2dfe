// The tuned constants of queries.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// What it costs to build a tree, for each of its geoms, in units of what a query without a tree
// pays for a geom, about 4 ns.
constexpr double build_cost = 12;

// The same to bring it up to date, for each geom that changed; a row of sixteen strays costs a
// query 1. Changes are noted one by one while that costs less than going through all geoms.
constexpr double refresh_cost = 4;

// Hits are marked rather than sorted if they are this part of all slots, but for a few.
constexpr std::size_t many_hits = 1024, few_hits = 16;

// How much wider than its boxes a cell is on each side, in parts of its extent: little enough to
// leave most queries the cells they would visit anyway; a pile that trembles stays within it.
constexpr double cell_margin = 1.0 / 16;

}  // namespace ode_parallel_sap
