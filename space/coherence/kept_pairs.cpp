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
  Merge(const Task& task, std::size_t old_begin, const SlotSet& changed, Buffer<Pair>& merged,
        PairChanges& changes)
      : begin_(task.begin),
        pair_(task.begin),
        end_(task.end),
        found_(task.found_begin),
        found_end_(task.found_end),
        old_begin_(old_begin),
        changed_(changed.view()),
        merged_(merged),
        changes_(changes) {}

  // Returns how many of the old ones stayed.
  std::size_t run() {
    const std::size_t count_found = found_end_ - found_;
    merged_.resizeDiscarding((end_ - pair_) + count_found);
    next_ = merged_.data();
    changes_.clear();
    Slot changed_earlier = pair_ < end_ ? changed_.firstFrom(earlierOf(*pair_)) : 0;
    while (pair_ < end_ || found_ < found_end_) {
      const Pair next_found = nextFound();
      const Pair of_changed = makePair(changed_earlier, 0);
      passOver(std::min(next_found, of_changed));
      if (next_found < of_changed) {
        meet();
      } else {
        while (pair_ < end_ && earlierOf(*pair_) == changed_earlier) meet();
        changed_earlier = changed_.firstFrom(changed_earlier + 1);
      }
    }
    merged_.resize(next_ - merged_.data());
    return merged_.size() - count_found;
  }

 private:
  Pair nextFound() const { return found_ < found_end_ ? *found_ : ~Pair{0}; }

  // Pairs below `limit`, whose earlier slots are all unchanged.
  void passOver(Pair limit) {
    while (end_ - pair_ >= step && pair_[step - 1] < limit) {
      bool any = false;
      for (std::ptrdiff_t i = 0; i < step; ++i) any |= changed_.contains(laterOf(pair_[i]));
      if (any) {
        for (std::ptrdiff_t i = 0; i < step; ++i) passOne();
      } else {
        std::memcpy(next_, pair_, step * sizeof(Pair));
        pair_ += step;
        next_ += step;
      }
    }
    while (pair_ < end_ && *pair_ < limit) passOne();
  }
  void passOne() {
    if (changed_.contains(laterOf(*pair_)))
      end();
    else
      *next_++ = *pair_++;
  }
  // The lesser of the next found pair and the next old one, which is of a changed slot if it is.
  void meet() {
    const Pair found = nextFound();
    if (pair_ < end_ && *pair_ < found) return end();
    if (pair_ < end_ && *pair_ == found)
      ++pair_;  // it lasts
    else
      changes_.begun.push_back(static_cast<std::size_t>(next_ - merged_.data()));
    *next_++ = *found_++;
  }
  void end() { changes_.ended.push_back(old_begin_ + static_cast<std::size_t>(pair_++ - begin_)); }

  const Pair* const begin_;
  const Pair *pair_, *const end_;
  const Pair *found_, *const found_end_;
  const std::size_t old_begin_;  // the place of *begin_ among all old pairs
  const SlotSet::View changed_;
  Buffer<Pair>& merged_;
  PairChanges& changes_;
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
  if (changes_.size() < tasks_.size()) changes_.resize(tasks_.size());
  pieces_.clear();
  std::size_t place = 0;
  for (const Task& task : tasks_) {
    const std::size_t begin = place;
    place += static_cast<std::size_t>(task.end - task.begin);
    pieces_.push_back({begin, place, &changes_[pieces_.size()]});
  }
  std::atomic<std::size_t> kept{0};
  const int team = static_cast<int>(std::min<std::size_t>(threads, tasks_.size()));
  runChunks(merging, team, tasks_.size(), 1, [&](const Range& range, int) {
    const std::size_t i = range.begin;
    kept += Merge(tasks_[i], pieces_[i].old_begin, changed, merged_.parts[i], changes_[i]).run();
  });
  kept_ = kept;
  std::swap(pairs, merged_);
}

}  // namespace ode_parallel_sap
