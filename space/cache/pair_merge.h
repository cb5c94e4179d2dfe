// The pairs of the last frame, made those of the next one.
#pragma once

#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/base/slot_set.h"

namespace ode_parallel_sap {

class PairMerge {
 public:
  // Takes all pairs that a slot of `changed` is in out of `pairs`, and puts `found`, all pairs of
  // these slots, in. Both are ascending, as is the result. Returns how many pairs stayed.
  std::size_t replace(const SlotSet& changed, const PairList& found, int threads, PairList& pairs);
  std::size_t bytes() const { return bytesOf(tasks_, joined_, merged_); }

 private:
  struct Task {
    const Pair *begin, *end, *found_begin, *found_end;
  };
  static std::size_t run(const Task& task, const SlotSet& changed, Buffer<Pair>& merged);
  const Buffer<Pair>& inOnePart(const PairList& found);
  void planTasks(const PairList& pairs, const Buffer<Pair>& found, int threads);

  std::vector<Task> tasks_;
  Buffer<Pair> joined_;
  PairList merged_;
};

}  // namespace ode_parallel_sap
