// Pairs of one earlier slot in 32 bits each. Internal linkage, as in kernels_impl.h.
#pragma once

#include <cstdint>

namespace {

// The later slot above the borderline mark, so that ascending words are pairs in their order.
inline std::uint64_t pairOfListWord(std::uint32_t word, std::uint32_t earlier) {
  return std::uint64_t{word} << 63 | std::uint64_t{earlier} << 32 | word >> 1;
}

}  // namespace
