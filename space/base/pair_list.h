// Pairs of slots, and the lists in which the extraction hands them on.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"

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

}  // namespace ode_parallel_sap
