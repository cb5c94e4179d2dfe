// A stable sort of 64-bit records by some of their bits, and a parallel one of pairs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Sorts records[0..count) by bits [low_bit, low_bit + bits). `scratch` has room for as many.
void radixSort(std::uint64_t* records, std::uint64_t* scratch, std::size_t count, int low_bit,
               int bits);

// Leaves the pairs of all `found` buffers in `pairs` as one part, in the order of the report. Slots
// are below `slots`. What `scratch` holds is lost.
void sortPairs(const std::vector<Buffer<Pair>>& found, std::size_t slots, int threads,
               Buffer<Pair>& scratch, PairList& pairs);

}  // namespace ode_parallel_sap
