// The pairs of few boxes with all others, found box by box and put among those of all.
#pragma once

#include <algorithm>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/pairs/row_table.h"

namespace ode_parallel_sap {

inline Region meeting_changed("changed pairs: boxes");

// Pairs that one thread merges, and those of another list that belong to them.
struct PairSpan {
  const Pair *begin, *end, *other, *other_end;
  std::size_t place;  // of the first one in its list
};

// Cuts ascending pairs into spans of `length` to twice as many, or a run's if that is shorter, and
// [other, other_end) before keyOf() of each later span's first pair. One span at least.
template <class KeyOf>
void cutBoth(const PairList& pairs, std::size_t length, const Pair* other, const Pair* other_end,
             KeyOf keyOf, std::vector<PairSpan>& spans) {
  spans.clear();
  std::size_t place = 0;
  for (const PairList::Run& run : pairs.runs) {
    const int pieces = static_cast<int>(std::max<std::size_t>(run.size() / length, 1));
    for (int i = 0; i < pieces; ++i) {
      const Range range = partOf(run.size(), i, pieces);
      const Pair* const begin = run.first + range.begin;
      if (!spans.empty())
        spans.back().other_end = other = std::lower_bound(other, other_end, keyOf(*begin));
      spans.push_back({begin, run.first + range.end, other, other_end, place});
      place += range.end - range.begin;
    }
  }
  if (spans.empty()) spans.push_back({nullptr, nullptr, other, other_end, 0});
}

class ChangedPairs {
 public:
  // Leaves in found(), ascending, the pairs of active `boxes` that have a slot of `changed`, pass
  // the filters and are kept by the test, if there is one. `set` has the same slots, and perhaps
  // slots that are gone. meet(slot, hits) leaves in `hits` all slots whose boxes overlap that of a
  // slot. It may add this slot, slots that are gone, and, unless `all_active`, inactive ones. Up to
  // `threads` threads call it. Returns the number used.
  template <class Meet>
  int find(const BoxSet& boxes, bool all_active, const Buffer<Slot>& changed, const SlotSet& set,
           int threads, const PairTest* test, Meet meet) {
    const std::size_t count = changed.size();
    const int team = teamFor(count, grains::changed_boxes, threads);
    rows_.start(boxes.size, threads);
    hits_.resize(std::max(hits_.size(), static_cast<std::size_t>(team)));
    const auto work = [&](const Range& range, int thread) {
      for (std::size_t i = range.begin; i < range.end; ++i) {
        const Slot slot = changed[i];
        if (!isActive(boxes, slot)) continue;
        meet(slot, hits_[thread]);
        for (const Slot hit : hits_[thread]) {
          // A pair of two changed slots is that of the later one.
          if (hit < boxes.size && hit != slot && !(hit > slot && set.contains(hit)) &&
              (all_active || isActive(boxes, hit)) && passesFilters(boxes, slot, hit))
            rows_.add(thread, hit < slot ? makePair(hit, slot) : makePair(slot, hit));
        }
      }
    };
    const int used =
        runChunks(meeting_changed, team, count, chunkOf(count, chunk_searches, team), work);
    rows_.writePairs(/*exact=*/true, threads, test, found_);
    return used;
  }
  PairList& found() { return found_; }
  // Takes all pairs that a slot of `changed` is in out of `pairs`, and puts found(), all pairs of
  // these slots, in. Both are ascending, as is the result. Returns how many pairs stayed.
  std::size_t replace(const SlotSet& changed, int threads, PairList& pairs);
  std::size_t bytes() const { return bytesOf(rows_, hits_, found_, spans_, merged_); }

 private:
  static bool isActive(const BoxSet& boxes, Slot slot) {
    return boxes.wide ? ode_parallel_sap::isActive(boxes.wide_boxes[slot])
                      : ode_parallel_sap::isActive(boxes.boxes[slot]);
  }
  static std::size_t merge(const PairSpan& span, const SlotSet& changed, Buffer<Pair>& merged);

  RowTable rows_;
  std::vector<Buffer<Slot>> hits_;  // one a thread
  PairList found_;
  std::vector<PairSpan> spans_;
  PairList merged_;
};

}  // namespace ode_parallel_sap
