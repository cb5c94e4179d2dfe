// The tuned constants of the narrow phase.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {

// Pairs that take as long as loading an image of ODE does, 1.5 ms, at 1.5 us a pair of a box and a
// mesh. Once they have been met images are loaded: whatever comes, it has cost no more than twice
// what would have been best.
constexpr std::uint64_t pairs_worth_an_image = 1000;

// Geoms lie scattered in memory, and what other threads wrote is in their caches: lines are asked
// for this many pairs before they are needed.
constexpr std::size_t pairs_ahead = 4;

}  // namespace ode_parallel_sap
