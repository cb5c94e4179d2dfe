// Pairs of slots, and the lists in which the extraction hands them on.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

// One pair in one word: `borderline`, earlier slot, later slot from the top down. Without the top
// bit, words in ascending order are pairs in the order of the report.
using Pair = std::uint64_t;

constexpr Pair borderline_bit = Pair{1} << 63;

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
constexpr bool isMarkedBorderline(Pair pair) {
  return (pair & borderline_bit) != 0;
}

// The pairs of one frame, in the order of the report when read part after part. Threads write parts
// of their own, so that joining them moves no pair.
struct PairList {
  // Pairs [begin, end) of a part.
  struct Segment {
    std::size_t part, begin, end;
  };

  std::vector<Buffer<Pair>> parts;
  // Every borderline pair is in one of these, with few others; in no particular order.
  std::vector<Segment> borderline;

  std::size_t size() const {
    std::size_t pairs = 0;
    for (const Buffer<Pair>& part : parts) pairs += part.size();
    return pairs;
  }
  std::size_t bytes() const { return bytesOf(parts, borderline); }
  // Empties `parts` parts for reuse; further ones keep their storage but hold nothing.
  void clear(std::size_t count) {
    clearForTeam(parts, count);
    borderline.clear();
  }
};

// Adds the segments of pairs [begin, end) of a part, whose first pair is at `part_pairs`, that
// have borderline ones: whole eights of pairs, 64 bytes, which are read about as fast as one of
// them.
inline void noteBorderline(const Pair* part_pairs, const PairList::Segment& written,
                           std::vector<PairList::Segment>& borderline) {
  constexpr std::size_t step = 8;               // fixed: a line of the cache
  constexpr std::size_t longest = chunk_pairs;  // of a segment
  for (std::size_t at = written.begin; at < written.end; at += step) {
    const Pair* const pairs = part_pairs + at;
    Pair all_bits = 0;
    if (at + step <= written.end)
      for (std::size_t i = 0; i < step; ++i) all_bits |= pairs[i];
    else
      for (std::size_t i = 0; at + i < written.end; ++i) all_bits |= pairs[i];
    if (!isMarkedBorderline(all_bits)) continue;
    const std::size_t end = std::min(at + step, written.end);
    if (!borderline.empty() && borderline.back().part == written.part &&
        borderline.back().end == at && at - borderline.back().begin < longest)
      borderline.back().end = end;
    else
      borderline.push_back({written.part, at, end});
  }
}

// Reads a list by the places of its pairs, counted through all parts, from the beginning on.
class PairCursor {
 public:
  explicit PairCursor(const PairList& list) : list_(list) {}

  // Calls use(begin, end) for the runs of pairs at places [begin, end), one after the other.
  // `begin` is no less than in any call before, and `end` no more than the size of the list.
  template <class Use>
  void read(std::size_t begin, std::size_t end, Use use) {
    while (begin < end) {
      while (begin >= part_begin_ + list_.parts[part_].size())
        part_begin_ += list_.parts[part_++].size();
      const Buffer<Pair>& part = list_.parts[part_];
      const std::size_t run_end = std::min(end, part_begin_ + part.size());
      use(part.data() + (begin - part_begin_), part.data() + (run_end - part_begin_));
      begin = run_end;
    }
  }

 private:
  const PairList& list_;
  std::size_t part_ = 0, part_begin_ = 0;  // its number, and the place of its first pair
};

}  // namespace ode_parallel_sap
