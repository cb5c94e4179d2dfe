#include "space/coherence/kept_pairs.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <utility>

#include "space/coherence/tuning.h"
#include "space/data/parallel.h"

namespace ode_parallel_sap {

namespace {

Region merging("kept pairs: parts");

// Pairs that are looked at before one of them is.
constexpr std::ptrdiff_t step = 8;  // fixed: a line of the cache

}  // namespace

// One part of both lists on its way into the new one.
class KeptPairs::Merge {
 public:
  Merge(const Task& task, const SlotSet& changed, Buffer<Pair>& merged)
      : pair_(task.begin),
        end_(task.end),
        found_(task.found_begin),
        found_end_(task.found_end),
        changed_(changed.view()),
        merged_(merged) {}

  // Returns how many of the old ones stayed.
  std::size_t run() {
    const std::size_t count_found = found_end_ - found_;
    merged_.resizeDiscarding((end_ - pair_) + count_found);
    next_ = merged_.data();
    Slot changed_earlier = pair_ < end_ ? changed_.firstFrom(earlierOf(*pair_)) : 0;
    while (pair_ < end_ || found_ < found_end_) {
      const Pair next_found = nextFound();
      const Pair of_changed = makePair(changed_earlier, 0);
      copyUnchanged(std::min(next_found, of_changed));
      if (next_found < of_changed) {
        *next_++ = *found_++;
      } else {
        while (pair_ < end_ && earlierOf(*pair_) == changed_earlier) ++pair_;
        changed_earlier = changed_.firstFrom(changed_earlier + 1);
      }
    }
    merged_.resize(next_ - merged_.data());
    return merged_.size() - count_found;
  }

 private:
  Pair nextFound() const { return found_ < found_end_ ? *found_ : ~Pair{0}; }

  // Of the pairs below `limit`, whose earlier slots are all unchanged.
  void copyUnchanged(Pair limit) {
    while (end_ - pair_ >= step && pair_[step - 1] < limit) {
      bool any = false;
      for (std::ptrdiff_t i = 0; i < step; ++i) any |= changed_.contains(laterOf(pair_[i]));
      if (any) {
        for (std::ptrdiff_t i = 0; i < step; ++i) copyOne();
      } else {
        std::memcpy(next_, pair_, step * sizeof(Pair));
        pair_ += step;
        next_ += step;
      }
    }
    while (pair_ < end_ && *pair_ < limit) copyOne();
  }
  void copyOne() {
    if (changed_.contains(laterOf(*pair_)))
      ++pair_;
    else
      *next_++ = *pair_++;
  }

  const Pair *pair_, *const end_;
  const Pair *found_, *const found_end_;
  const SlotSet::View changed_;
  Buffer<Pair>& merged_;
  Pair* next_ = nullptr;
};

// Cuts the pairs into parts of like length, and the found ones where those begin.
void KeptPairs::planTasks(const PairList& pairs, const PairList& found, int threads) {
  const std::size_t task_pairs = chunkOf(pairs.size(), part_pairs, threads);
  const Pair* const found_begin = found.parts[0].begin();
  const Pair* const found_end = found.parts[0].end();
  tasks_.clear();
  for (const Buffer<Pair>& part : pairs.parts) {
    const std::size_t pieces = std::max<std::size_t>(part.size() / task_pairs, 1);
    for (std::size_t i = 0; i < pieces && part.size(); ++i) {
      const Range range = partOf(part.size(), static_cast<int>(i), static_cast<int>(pieces));
      tasks_.push_back({part.data() + range.begin, part.data() + range.end, nullptr, nullptr});
    }
  }
  if (tasks_.empty()) tasks_.push_back({nullptr, nullptr, nullptr, nullptr});
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    tasks_[i].found_begin =
        i == 0 ? found_begin : std::lower_bound(found_begin, found_end, *tasks_[i].begin);
    if (i > 0) tasks_[i - 1].found_end = tasks_[i].found_begin;
  }
  tasks_.back().found_end = found_end;
}

void KeptPairs::replace(const SlotSet& changed, const PairList& found, int threads,
                        PairList& pairs) {
  planTasks(pairs, found, threads);
  merged_.clear(tasks_.size());
  std::atomic<std::size_t> kept{0};
  const int team = static_cast<int>(std::min<std::size_t>(threads, tasks_.size()));
  runChunks(merging, team, tasks_.size(), 1, [&](const Range& range, int) {
    const std::size_t i = range.begin;
    kept += Merge(tasks_[i], changed, merged_.parts[i]).run();
  });
  kept_ = kept;
  std::swap(pairs, merged_);
}

}  // namespace ode_parallel_sap
