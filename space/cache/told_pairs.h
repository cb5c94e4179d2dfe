// The pairs of a frame, found again in the next one without a copy of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <new>
#include <utility>
#include <vector>

#include "space/data/pair_list.h"

namespace ode_parallel_sap {

// They lie where the frame had them, in whatever list these buffers are by now. Who is about to
// write there offers the list to keep() first.
class ToldPairs {
 public:
  // Then see() of a list of so many parts needs no memory.
  void reserve(std::size_t parts) { runs_.reserve(parts); }
  void see(const PairList& pairs) {
    runs_.clear();
    size_ = 0;
    for (const Buffer<Pair>& part : pairs.parts) {
      if (part.size() == 0) continue;
      runs_.push_back({part.begin(), part.end(), size_});
      size_ += part.size();
    }
  }
  // If they lie in `pairs` this becomes a list without pairs, and they stay.
  void keep(PairList& pairs) {
    if (!areIn(pairs)) return;
    std::swap(pairs, kept_);
    pairs.clear(0);
  }

  std::size_t size() const { return size_; }
  Pair at(std::size_t place) const {
    const auto run =
        std::upper_bound(runs_.begin(), runs_.end(), place,
                         [](std::size_t wanted, const Run& other) { return wanted < other.place; });
    return std::prev(run)->begin[place - std::prev(run)->place];
  }
  // The number of those that come before this one.
  std::size_t before(Pair pair) const {
    const auto run =
        std::upper_bound(runs_.begin(), runs_.end(), pair,
                         [](Pair wanted, const Run& other) { return wanted < *other.begin; });
    if (run == runs_.begin()) return 0;
    const Run& in = *std::prev(run);
    return in.place + static_cast<std::size_t>(std::lower_bound(in.begin, in.end, pair) - in.begin);
  }
  // Calls use(begin, end, place of *begin) for the stretches of places [begin, end).
  template <class Use>
  void forRuns(std::size_t begin, std::size_t end, Use use) const {
    for (const Run& run : runs_) {
      const std::size_t first = std::max(begin, run.place);
      const std::size_t last = std::min(end, run.place + (run.end - run.begin));
      if (first < last) use(run.begin + (first - run.place), run.begin + (last - run.place), first);
    }
  }

  // Gives back what is held besides them.
  void shrink() {
    if (!areIn(kept_)) {
      kept_ = PairList();
      return;
    }
    try {
      for (Buffer<Pair>& part : kept_.parts) part.shrink();
    } catch (const std::bad_alloc&) {  // it stays as it is
    }
    see(kept_);
  }
  std::size_t bytes() const { return bytesOf(runs_, kept_); }

 private:
  struct Run {
    const Pair *begin, *end;
    std::size_t place;  // of *begin
  };
  bool areIn(const PairList& pairs) const {
    for (const Buffer<Pair>& part : pairs.parts)
      if (part.size()) return !runs_.empty() && runs_.front().begin == part.begin();
    return false;
  }

  std::vector<Run> runs_;  // none is empty
  std::size_t size_ = 0;
  PairList kept_;
};

}  // namespace ode_parallel_sap
