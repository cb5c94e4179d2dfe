// Pairs of slots, and the lists in which the extraction hands them on.
#ifndef ODE_PARALLEL_SAP_PAIR_LIST_H
#define ODE_PARALLEL_SAP_PAIR_LIST_H

#include <algorithm>
#include <cstdint>
#include <vector>

#include "space/data/box_set.h"
#include "space/data/buffer.h"

namespace ode_parallel_sap {

// One pair in one word: `unsure`, earlier slot, later slot from the top down. Without the top bit,
// words in ascending order are pairs in the order of the report.
using Pair = std::uint64_t;

constexpr Pair unsure_bit = Pair{1} << 63;

constexpr Pair makePair(Slot earlier, Slot later) {
  return Pair{earlier} << 32 | later;
}
constexpr Slot earlierOf(Pair pair) {
  return static_cast<Slot>(pair >> 32 & 0x7fffffff);
}
constexpr Slot laterOf(Pair pair) {
  return static_cast<Slot>(pair);
}
// Whether only the exact bounds can tell if the two boxes overlap.
constexpr bool isUnsure(Pair pair) {
  return (pair & unsure_bit) != 0;
}

// The pairs of one frame, in the order of the report when read part after part. Threads write parts
// of their own, so that joining them moves no pair.
struct PairList {
  // Pairs [begin, end) of a part.
  struct Stretch {
    std::size_t part, begin, end;
  };

  std::vector<Buffer<Pair>> parts;
  std::vector<Stretch> unsure;  // every unsure pair is in one of these; in no particular order

  std::size_t size() const {
    std::size_t pairs = 0;
    for (const Buffer<Pair>& part : parts) pairs += part.size();
    return pairs;
  }
  std::size_t bytes() const {
    std::size_t bytes = 0;
    for (const Buffer<Pair>& part : parts) bytes += part.bytes();
    return bytes;
  }
  // Takes the pairs of another list, in one part, without what is unsure of them.
  void copyFrom(const PairList& other) {
    clear(1);
    parts[0].resizeDiscarding(other.size());
    Pair* next = parts[0].data();
    for (const Buffer<Pair>& part : other.parts) next = std::copy(part.begin(), part.end(), next);
  }
  // Empties `parts` parts for reuse; further ones keep their storage but hold nothing.
  void clear(std::size_t count) {
    if (parts.size() < count) parts.resize(count);
    for (Buffer<Pair>& part : parts) part.resizeDiscarding(0);
    unsure.clear();
  }
};

}  // namespace ode_parallel_sap

#endif
