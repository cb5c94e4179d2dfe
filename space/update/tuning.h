// The tuned constants of boxes made of geoms.
#pragma once

#include <cstddef>

#include "space/data/tuning.h"

namespace ode_parallel_sap {

// Counters that lie scattered in memory are asked for in blocks of so many before they are needed.
constexpr std::size_t prefetched_block = 2 * prefetch_distance;

// Geoms are brought up to date in blocks of so many: their poses and bounds are asked for while
// they are listed.
constexpr std::size_t update_block = prefetch_distance;

// Counters of clusters, so that boxes all far from each other seem to make a pair for sixteen boxes
// at most.
// Unit: counters. From: peers, far from the origin.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t counters_a_box = 8;

}  // namespace ode_parallel_sap
