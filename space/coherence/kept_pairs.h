// The pairs of the last frame, made those of the next one.
#pragma once

#include <vector>

#include "space/data/pair_list.h"
#include "space/data/slot_set.h"

namespace ode_parallel_sap {

class KeptPairs {
 public:
  // Takes all pairs that a slot of `changed` is in out of `pairs` and puts `found`, which are all
  // of theirs, in. Both ascending, as is the result.
  void replace(const SlotSet& changed, const PairList& found, int threads, PairList& pairs);
  // Of the last replace(): the number of pairs that stayed.
  std::size_t kept() const { return kept_; }
  std::size_t bytes() const { return bytesOf(tasks_, merged_); }

 private:
  struct Task {
    const Pair *begin, *end, *found_begin, *found_end;
  };
  class Merge;
  void planTasks(const PairList& pairs, const PairList& found, int threads);

  std::vector<Task> tasks_;
  PairList merged_;
  std::size_t kept_ = 0;
};

}  // namespace ode_parallel_sap
