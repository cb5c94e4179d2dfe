// The tuned constants of the narrow phase.
#ifndef ODE_PARALLEL_SAP_CONTACTS_TUNING_H
#define ODE_PARALLEL_SAP_CONTACTS_TUNING_H

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {

// Pairs that take as long as loading an image of ODE does, 1.5 ms, at 1.5 us a pair of a box and a
// mesh. Once they have been met images are loaded: whatever comes, it has cost no more than twice
// what would have been best.
// Unit: pairs. From: results/xeon-16-cores/parts.csv.
// Doubled: not measured. Halved: not measured.
constexpr std::uint64_t pairs_worth_an_image = 1000;

// Geoms lie scattered in memory, and what other threads wrote is in their caches: lines are asked
// for this many pairs before they are needed.
// Unit: pairs. From: results/xeon-16-cores/parts.csv.
// Doubled: not measured. Halved: not measured.
constexpr std::size_t pairs_ahead = 4;

// Pairs that want an image of ODE are met by the calling thread until there have been so many for
// each image: to load one takes about as long as these.
// Unit: pairs. From: narrow.
// Doubled: not measured. Halved: not measured.
constexpr std::uint64_t pairs_worth_an_image = 1000;

// Pairs of two boxes are tested for being apart where more than this part of them is: in
// instructions the test takes 165 and saves 460 where they are.
// Unit: 1. From: apart.
// Doubled: not measured. Halved: not measured.
constexpr double least_apart_boxes = 0.3;

// The same of pairs of other shapes: 100 to 200 instructions, and 200 to 350.
// Unit: 1. From: apart.
// Doubled: not measured. Halved: not measured.
constexpr double least_apart_others = 0.7;

}  // namespace ode_parallel_sap

#endif
