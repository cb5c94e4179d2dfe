// Pairs of slots, lists of them, and the interface of every method that finds them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"

namespace ode_parallel_sap {

// One pair in one word: `borderline`, earlier slot, later slot from the top down. Without the top
// bit, words in ascending order are pairs in the order of the report.
using Pair = std::uint64_t;

constexpr Pair borderline_bit = Pair{1} << 63;

// The place that a pair had when its geoms were last seen to touch, while they do.
using Touch = std::uint32_t;
constexpr Touch no_touch = ~Touch{0};

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

// What decides about pairs where boxes do not. Many threads use it at once.
class PairTest {
 public:
  explicit PairTest(bool every_pair) : every_pair_(every_pair) {}
  // Whether it decides about all pairs, not about borderline ones alone.
  bool everyPair() const { return every_pair_; }
  // Moves the pairs that stay to the front, in their order and unmarked. Returns their end.
  virtual Pair* keep(Pair* begin, Pair* end) const = 0;

 protected:
  ~PairTest() = default;

 private:
  const bool every_pair_;
};

// The pairs of one frame, in the order of the report when read run after run. Threads write to
// parts of their own, and gaps stay where pairs were dropped, so no pair is moved to another list.
struct PairList {
  struct Run {
    Pair *first = nullptr, *last = nullptr;
    bool decided = true;  // no pair of it is borderline

    const Pair* begin() const { return first; }
    const Pair* end() const { return last; }
    std::size_t size() const { return static_cast<std::size_t>(last - first); }
  };

  std::vector<Buffer<Pair>> parts;  // the storage
  std::vector<Run> runs;            // what of it holds pairs

  std::size_t size() const {
    std::size_t pairs = 0;
    for (const Run& run : runs) pairs += run.size();
    return pairs;
  }
  std::size_t bytes() const { return bytesOf(parts, runs); }
  // Empties `count` parts for reuse; further ones keep their storage but hold nothing.
  void clear(std::size_t count) {
    clearForTeam(parts, count);
    runs.clear();
  }
  // Adds a run, or makes the last one longer if it goes on there, in the same part.
  void add(const Run& run) {
    if (run.size() == 0) return;
    if (!runs.empty() && runs.back().last == run.first && runs.back().decided == run.decided)
      runs.back().last = run.last;
    else
      runs.push_back(run);
  }
  // The parts hold pairs from begin to end.
  void addParts(bool decided) {
    runs.clear();
    for (Buffer<Pair>& part : parts)
      if (part.size() > 0) runs.push_back({part.begin(), part.end(), decided});
  }
  // Leaves out the pairs that the test drops of runs that are not decided, or of all. Null keeps
  // all, with their marks.
  void decide(const PairTest* test, int threads);
  // Closes the gaps of the first part, if it holds all pairs.
  void closeGaps();
  // Runs lie in the parts, and their pairs ascend, each once, unmarked, the earlier slot first.
  void validate(std::size_t slots) const;
};

// Reads a list by the places of its pairs, counted through all runs, from the beginning on.
class PairCursor {
 public:
  explicit PairCursor(const PairList& list) : list_(list) {}

  // Calls use(begin, end) for the runs of pairs at places [begin, end), one after the other.
  // `begin` is no less than in any call before, and `end` no more than the size of the list.
  template <class Use>
  void read(std::size_t begin, std::size_t end, Use use) {
    while (begin < end) {
      while (begin >= run_begin_ + list_.runs[run_].size()) run_begin_ += list_.runs[run_++].size();
      const PairList::Run& run = list_.runs[run_];
      const std::size_t run_end = std::min(end, run_begin_ + run.size());
      use(run.begin() + (begin - run_begin_), run.begin() + (run_end - run_begin_));
      begin = run_end;
    }
  }

 private:
  const PairList& list_;
  std::size_t run_ = 0, run_begin_ = 0;  // its number, and the place of its first pair
};

// Whether only the exact boxes can tell that two overlap whose float bounds do: a bound is equal to
// the opposite one. Doubles are the exact bounds.
template <class Real>
inline bool isBorderline(const BasicBox<Real>& a, const BasicBox<Real>& b) {
  Real gap = a.lower[0] - b.upper[0];
  for (int axis = 0; axis < 3; ++axis)
    gap = std::max(std::max(gap, a.lower[axis] - b.upper[axis]), b.lower[axis] - a.upper[axis]);
  return sizeof(Real) == sizeof(float) && gap == 0;
}

inline bool passesFilters(const BoxSet& boxes, Slot a, Slot b) {
  if (boxes.filter_bits && !(boxes.bits[a].category & boxes.bits[b].collide) &&
      !(boxes.bits[b].category & boxes.bits[a].collide))
    return false;
  return !boxes.filter_bodies || !boxes.bodies[a] || boxes.bodies[a] != boxes.bodies[b];
}

// Writes the pair of two overlapping boxes that pass the filters to *to. Returns what follows it.
inline Pair* writePair(const BoxSet& boxes, Slot a, Slot b, Pair* to) {
  if (!passesFilters(boxes, a, b)) return to;
  *to = a < b ? makePair(a, b) : makePair(b, a);
  if (!boxes.exact && !boxes.wide && isBorderline(boxes.boxes[a], boxes.boxes[b]))
    *to |= borderline_bit;
  return to + 1;
}

// The most bytes of the paper's lists, on each device. 0, but in tests: half of what is free.
inline std::atomic<std::uint64_t> most_list_bytes{0};

// They need more memory than they may take. Both in bytes.
class ListsTooLong : public std::runtime_error {
 public:
  ListsTooLong(std::uint64_t needed, std::uint64_t allowed)
      : std::runtime_error("the lists of pairs are too long"), needed(needed), allowed(allowed) {}
  std::uint64_t needed, allowed;
};

// Reads boxes of a frame while others are still made.
class BoxReader {
 public:
  // Boxes [first, last) do not change any more. They come in their order, from the first on, and
  // have storage for all of the frame, which stays until the pairs are found or forget() returns.
  virtual void read(const BoxSet& boxes, std::size_t first, std::size_t last) = 0;
  // There will be no pairs of them.
  virtual void forget() = 0;

 protected:
  ~BoxReader() = default;
};

class PairFinder {
 public:
  virtual ~PairFinder() = default;

  // Puts into `pairs`, ascending and each once, every pair of slots whose boxes overlap (closed
  // intervals, NaN overlaps nothing), which passes the filters of `boxes` and which `test` keeps.
  // It decides about pairs that float boxes cannot decide about; without it they stay, and carry
  // borderline_bit. Uses up to `threads` threads; returns the number used. Throws std::bad_alloc
  // where memory ends.
  virtual int find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) = 0;
  int find(const BoxSet& boxes, int threads, PairList& pairs) {
    return find(boxes, threads, pairs, nullptr);
  }

  // Bytes held from one frame to the next.
  virtual std::size_t bytes() const = 0;
};

}  // namespace ode_parallel_sap
