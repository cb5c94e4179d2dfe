// The tuned constants of the narrow phase.
#ifndef ODE_PARALLEL_SAP_CONTACTS_TUNING_H
#define ODE_PARALLEL_SAP_CONTACTS_TUNING_H

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {

// Pairs that a thread collides at a time: few enough that nobody waits long for the last one.
// Unit: pairs. From: results/xeon-16-cores/parts.csv.
// Doubled: not measured. Halved: not measured.
constexpr std::size_t most_pairs_a_chunk = 32;

// Geoms lie scattered in memory, and what other threads wrote is in their caches: lines are asked
// for this many pairs before they are needed.
// Unit: pairs. From: results/xeon-16-cores/parts.csv.
// Doubled: not measured. Halved: not measured.
constexpr std::size_t pairs_ahead = 4;

// A pair with more contacts than this is not told beforehand: room for so many is filled for every
// pair. Two boxes have eight at most, a box and a cylinder sometimes more.
// Unit: contacts. From: instructions of foretell-benchmark.
// Doubled: not measured. Halved: not measured.
constexpr std::uint32_t most_told_contacts = 16;

// A program that collides a pair which it is not just being told of may have left out some since
// the last one. Unit: pairs. From: instructions of foretell-benchmark. Doubled: not measured.
// Halved: not measured.
constexpr std::size_t places_looked_at = 8;

}  // namespace ode_parallel_sap

#endif
