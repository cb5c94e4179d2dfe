// The tuned constants of the narrow phase.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// Geoms lie scattered in memory, and what other threads wrote is in their caches: lines are asked
// for this many pairs before they are needed.
constexpr std::size_t pairs_ahead = 4;

}  // namespace ode_parallel_sap
