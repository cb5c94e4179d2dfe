// The tuned constants of boxes made of geoms.
#ifndef ODE_PARALLEL_SAP_UPDATE_TUNING_H
#define ODE_PARALLEL_SAP_UPDATE_TUNING_H

#include <cstddef>

namespace ode_parallel_sap {

// What lies scattered in memory is asked for in blocks of this many geoms or boxes, before they are
// needed.
// Unit: geoms. From: peers, dense-cube of 1,000,000.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t prefetched_block = 32;

// Counters of clusters, so that boxes all far from each other seem to make a pair for sixteen boxes
// at most.
// Unit: counters. From: peers, far from the origin.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t counters_a_box = 8;

}  // namespace ode_parallel_sap

#endif
