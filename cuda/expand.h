// From what the device sends to pairs.
#ifndef ODE_PARALLEL_SAP_CUDA_EXPAND_H
#define ODE_PARALLEL_SAP_CUDA_EXPAND_H

#include <cstddef>
#include <cstdint>

#include "../space/pair_list.h"

namespace ode_parallel_sap {

// The lists of all slots one after the other. A word of a list is the later slot above one bit:
// whether the pair is unsure.
struct ListIndex {
  std::size_t slots;
  std::size_t block;                       // slots of a block
  const unsigned long long* block_begins;  // words before each block, and of all
  const std::uint8_t* short_counts;        // words of each slot's list, all below 255; or
  const std::uint32_t* counts;             // the same, if not null
};

// Writes pairs [begin, end) of all pairs to `pairs`, from `words`: words[0] is the begin-th of all.
// Returns whether one is unsure. Nothing beyond [begin, end) is written or read.
bool expandPairs(const ListIndex& index, const std::uint32_t* words, std::size_t begin,
                 std::size_t end, Pair* pairs);

}  // namespace ode_parallel_sap

#endif
