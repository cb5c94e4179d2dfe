// A parallel sort of pairs.
#pragma once

#include <cstddef>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Leaves the pairs of all `found` buffers in `pairs` as one part, in the order of the report. Slots
// are below `slots`. What `scratch` holds is lost.
void sortPairs(const std::vector<Buffer<Pair>>& found, std::size_t slots, int threads,
               Buffer<Pair>& scratch, PairList& pairs);

}  // namespace ode_parallel_sap
