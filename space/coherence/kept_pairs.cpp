#include "space/coherence/kept_pairs.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "space/coherence/tuning.h"
#include "space/data/parallel.h"

namespace ode_parallel_sap {

namespace {

Region merging("kept pairs: parts");

// Merges both into `merged`; returns how many of [begin, end) stayed.
std::size_t mergePart(const Pair* begin, const Pair* end, const Pair* found, const Pair* found_end,
                      const SlotSet& changed, Buffer<Pair>& merged) {
  const SlotSet::View changes = changed.view();
  const std::size_t count_found = found_end - found;
  merged.resizeDiscarding((end - begin) + count_found);
  Pair* next = merged.data();
  Slot changed_earlier = begin < end ? changes.firstFrom(earlierOf(*begin)) : 0;
  for (const Pair* pair = begin; pair < end || found < found_end;) {
    const Pair next_found = found < found_end ? *found : ~Pair{0};
    const Pair limit = std::min(next_found, makePair(changed_earlier, 0));
    // Which later slots changed nothing foretells: each pair is written, and the next one over it.
    for (; pair < end && *pair < limit; ++pair) {
      *next = *pair;
      next += !changes.contains(laterOf(*pair));
    }
    if (limit == next_found) {
      *next++ = *found++;
    } else {
      while (pair < end && earlierOf(*pair) == changed_earlier) ++pair;
      changed_earlier = changes.firstFrom(changed_earlier + 1);
    }
  }
  merged.resize(next - merged.data());
  return merged.size() - count_found;
}

}  // namespace

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
    const Task& task = tasks_[range.begin];
    kept += mergePart(task.begin, task.end, task.found_begin, task.found_end, changed,
                      merged_.parts[range.begin]);
  });
  kept_ = kept;
  std::swap(pairs, merged_);
}

}  // namespace ode_parallel_sap
