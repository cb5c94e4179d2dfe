// The pairs of the last frame, made those of the next one.
#pragma once

#include <vector>

#include "space/coherence/pair_changes.h"
#include "space/data/pair_list.h"
#include "space/data/slot_set.h"

namespace ode_parallel_sap {

class KeptPairs {
 public:
  // Takes all pairs that a slot of `changed` is in out of `pairs` and puts `found`, which are all
  // of theirs, in. Both ascending, as is the result.
  void replace(const SlotSet& changed, const PairList& found, int threads, PairList& pairs);
  // Of the last replace(): pairs that it left where they were,
  std::size_t kept() const { return kept_; }
  // the pairs of before,
  PairList& replaced() { return merged_; }
  // and what began and ended, by parts of the new list.
  const std::vector<ChangedPiece>& changes() const { return pieces_; }
  std::size_t bytes() const { return bytesOf(tasks_, merged_, pieces_, changes_); }

 private:
  struct Task {
    const Pair *begin, *end, *found_begin, *found_end;
  };
  class Merge;
  void planTasks(const PairList& pairs, const PairList& found, int threads);

  std::vector<Task> tasks_;
  PairList merged_;
  std::vector<ChangedPiece> pieces_;  // by task
  std::vector<PairChanges> changes_;  // likewise
  std::size_t kept_ = 0;
};

}  // namespace ode_parallel_sap
