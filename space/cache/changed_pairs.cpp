#include "space/cache/changed_pairs.h"

#include <atomic>
#include <cstring>
#include <utility>

namespace ode_parallel_sap {

namespace {

// Pairs that are tested before one of them is.
constexpr std::ptrdiff_t step = 8;  // fixed: a line of the cache

// A round number: kept pairs that a thread merges at a time; parts of twice that are cut.
constexpr std::size_t part_pairs = std::size_t{1} << 16;

Region merging("pair merge: parts");

}  // namespace

// Writes one part of both lists to `merged`. Returns how many of the old pairs stayed.
std::size_t ChangedPairs::merge(const PairSpan& span, const SlotSet& changed,
                                Buffer<Pair>& merged) {
  const Pair *pair = span.begin, *found = span.other;
  const std::size_t found_pairs = span.other_end - found;
  merged.resizeDiscarding((span.end - pair) + found_pairs);
  Pair* next = merged.data();
  const auto copyUnlessChanged = [&](Pair old) {
    *next = old;
    next += !changed.contains(laterOf(old));
  };
  // Old pairs below `limit`, whose earlier slots are all unchanged.
  const auto copyBelow = [&](Pair limit) {
    while (span.end - pair >= step && pair[step - 1] < limit) {
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
    while (pair < span.end && *pair < limit) copyUnlessChanged(*pair++);
  };
  Slot changed_earlier = pair < span.end ? changed.firstFrom(earlierOf(*pair)) : 0;
  while (pair < span.end || found < span.other_end) {
    const Pair next_found = found < span.other_end ? *found : ~Pair{0};
    const Pair of_changed = makePair(changed_earlier, 0);
    copyBelow(std::min(next_found, of_changed));
    if (next_found < of_changed) {
      *next++ = *found++;
    } else {
      while (pair < span.end && earlierOf(*pair) == changed_earlier) ++pair;
      changed_earlier = changed.firstFrom(changed_earlier + 1);
    }
  }
  merged.resize(next - merged.data());
  return merged.size() - found_pairs;
}

std::size_t ChangedPairs::replace(const SlotSet& changed, int threads, PairList& pairs) {
  found_.closeGaps();
  const PairList::Run found = found_.runs.empty() ? PairList::Run() : found_.runs[0];
  cutBoth(
      pairs, chunkOf(pairs.size(), part_pairs, threads), found.begin(), found.end(),
      [](Pair pair) { return pair; }, spans_);
  merged_.clear(spans_.size());
  std::atomic<std::size_t> kept{0};
  const int team = static_cast<int>(std::min<std::size_t>(threads, spans_.size()));
  runChunks(merging, team, spans_.size(), 1, [&](const Range& range, int) {
    const std::size_t i = range.begin;
    kept += merge(spans_[i], changed, merged_.parts[i]);
  });
  merged_.addParts(/*decided=*/true);
  std::swap(pairs, merged_);
  return kept;
}

}  // namespace ode_parallel_sap
