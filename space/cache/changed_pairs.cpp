#include "space/cache/changed_pairs.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <utility>

#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

// Pairs that are tested before one of them is.
constexpr std::ptrdiff_t step = 8;  // fixed: a line of the cache

Region merging("pair merge: parts");

}  // namespace

// Writes one part of both lists to `merged`. Returns how many of the old pairs stayed.
std::size_t ChangedPairs::merge(const Task& task, const SlotSet& changed, Buffer<Pair>& merged) {
  const Pair *pair = task.begin, *found = task.found_begin;
  const std::size_t found_pairs = task.found_end - found;
  merged.resizeDiscarding((task.end - pair) + found_pairs);
  Pair* next = merged.data();
  const auto copyUnlessChanged = [&](Pair old) {
    *next = old;
    next += !changed.contains(laterOf(old));
  };
  // Old pairs below `limit`, whose earlier slots are all unchanged.
  const auto copyBelow = [&](Pair limit) {
    while (task.end - pair >= step && pair[step - 1] < limit) {
      bool any = false;
      for (std::ptrdiff_t i = 0; i < step; ++i) any |= changed.contains(laterOf(pair[i]));
      if (any) {
        for (std::ptrdiff_t i = 0; i < step; ++i) copyUnlessChanged(pair[i]);
      } else {
        std::memcpy(next, pair, step * sizeof(Pair));
        next += step;
      }
      pair += step;
    }
    while (pair < task.end && *pair < limit) copyUnlessChanged(*pair++);
  };
  Slot changed_earlier = pair < task.end ? changed.firstFrom(earlierOf(*pair)) : 0;
  while (pair < task.end || found < task.found_end) {
    const Pair next_found = found < task.found_end ? *found : ~Pair{0};
    const Pair of_changed = makePair(changed_earlier, 0);
    copyBelow(std::min(next_found, of_changed));
    if (next_found < of_changed) {
      *next++ = *found++;
    } else {
      while (pair < task.end && earlierOf(*pair) == changed_earlier) ++pair;
      changed_earlier = changed.firstFrom(changed_earlier + 1);
    }
  }
  merged.resize(next - merged.data());
  return merged.size() - found_pairs;
}

// The filter leaves what it has dropped some of in several parts.
const Buffer<Pair>& ChangedPairs::inOnePart() {
  if (found_.size() == found_.parts[0].size()) return found_.parts[0];
  joined_.resizeDiscarding(found_.size());
  Pair* end = joined_.data();
  for (const Buffer<Pair>& part : found_.parts) end = std::copy(part.begin(), part.end(), end);
  return joined_;
}

// Cuts the pairs into parts of like length, and the found ones where those begin.
void ChangedPairs::planTasks(const PairList& pairs, const Buffer<Pair>& found, int threads) {
  const std::size_t task_pairs = chunkOf(pairs.size(), part_pairs, threads);
  const Pair* const found_begin = found.begin();
  const Pair* const found_end = found.end();
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

std::size_t ChangedPairs::replace(const SlotSet& changed, int threads, PairList& pairs) {
  planTasks(pairs, inOnePart(), threads);
  merged_.clear(tasks_.size());
  std::atomic<std::size_t> kept{0};
  const int team = static_cast<int>(std::min<std::size_t>(threads, tasks_.size()));
  runChunks(merging, team, tasks_.size(), 1, [&](const Range& range, int) {
    const std::size_t i = range.begin;
    kept += merge(tasks_[i], changed, merged_.parts[i]);
  });
  std::swap(pairs, merged_);
  return kept;
}

}  // namespace ode_parallel_sap
