// Pairs found in any order by several threads, put in the order of the report.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Two steps: pairs are dealt into buckets of neighbouring earlier slots, then each bucket is sorted
// by itself while it is in the cache. A list that fits the cache is a bucket as it is.
class PairOrder {
 public:
  // Leaves the pairs of all `found` buffers in `pairs` as one part, ascending. Slots are below
  // `slots`, which is 2^30 at most.
  void sort(const std::vector<Buffer<Pair>>& found, std::size_t slots, int threads,
            PairList& pairs);
  std::size_t bytes() const { return bytesOf(positions_, bucket_begin_, scratch_); }

 private:
  struct alignas(64) Scratch {
    std::vector<std::uint32_t> counts;
    Buffer<Pair> pairs;
    Buffer<std::uint32_t> words;
    std::vector<PairList::Segment> borderline;

    std::size_t bytes() const { return bytesOf(counts, pairs, words, borderline); }
  };
  // Bucket i has the pairs whose earlier slots are i << shift and following.
  struct Buckets {
    std::size_t count = 1, slots = 0;
    int shift = 0;
    int slot_bits = 0;

    Slot firstSlot(std::size_t bucket) const { return static_cast<Slot>(bucket << shift); }
    std::size_t slotsOf(std::size_t bucket) const {
      return std::min(std::size_t{1} << shift, slots - std::size_t{firstSlot(bucket)});
    }
  };
  static Buckets bucketsFor(std::size_t count, std::size_t slots, int threads);
  void deal(const std::vector<Buffer<Pair>>& found, const Buckets& buckets, int threads,
            Pair* dealt);
  // Return whether one of the pairs is borderline.
  static bool sortBucket(const Pair* found, std::size_t count, const Buckets& buckets,
                         std::size_t bucket, Pair* pairs, Scratch& scratch);
  class ShortPair;
  template <int passes, int digit_bits>
  static bool sortWords(const Pair* found, std::size_t count, const ShortPair& shape, Pair* pairs,
                        Scratch& scratch);
  static bool sortWide(Pair* pairs, std::size_t count, int slot_bits, Scratch& scratch);

  std::vector<std::size_t> positions_;
  std::vector<std::size_t> bucket_begin_;
  std::vector<Scratch> scratch_;
};

}  // namespace ode_parallel_sap
