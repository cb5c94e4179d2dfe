// From what the device sends to pairs.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/one/scene_plan.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Writes the pairs of the first `words` words of a segment (scene_plan.h), at most segment_words.
// Bit i of has_list: slot i has a list. `pairs` is aligned to 16 bytes. Returns whether one
// is borderline.
bool expandSegment(const std::uint32_t* segment, std::size_t words, const std::uint32_t* has_list,
                   Pair* pairs);

}  // namespace ode_parallel_sap
