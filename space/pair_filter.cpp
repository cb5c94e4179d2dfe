#include "pair_filter.h"

#include <algorithm>

#include "floating_point.h"
#include "geom_tests.h"
#include "parallel.h"

namespace ode_parallel_sap {

namespace {

constexpr Pair dropped_pair = ~Pair{0};
// A thread is worth its start from this many pairs on.
constexpr std::size_t least_pairs_a_thread = 16384;
constexpr std::size_t chunk_pairs = 4096;

// Whether the geoms decide otherwise than the boxes did.
struct ExactTest {
  dxGeom* const* geoms;
  bool every_filter;  // the filter bits or bodies beside the boxes do not decide

  bool drops(Pair pair) const {
    if (!isUnsure(pair) && !every_filter) return false;
    const dxGeom *const a = geoms[earlierOf(pair)], *const b = geoms[laterOf(pair)];
    return (isUnsure(pair) && !boxesOverlap(a, b)) || (every_filter && !filtersMatch(a, b));
  }
};

std::size_t testRange(const ExactTest& test, Pair* pairs, const Range& range) {
  std::size_t dropped = 0;
  for (std::size_t i = range.begin; i < range.end; ++i) {
    if (test.drops(pairs[i])) {
      pairs[i] = dropped_pair;
      ++dropped;
    } else {
      pairs[i] &= ~unsure_bit;
    }
  }
  return dropped;
}

std::size_t callUserTests(dxGeom* const* geoms, Buffer<Pair>& pairs) {
  std::size_t dropped = 0;
  for (Pair& pair : pairs) {
    if (pair == dropped_pair) continue;
    if (!passesAABBTests(geoms[earlierOf(pair)], geoms[laterOf(pair)])) {
      pair = dropped_pair;
      ++dropped;
    }
  }
  return dropped;
}

}  // namespace

void PairFilter::run(dxGeom* const* geoms, const UpdateFacts& facts, bool exact_boxes, int threads,
                     PairList& pairs) {
  const ExactTest test = {geoms, !facts.exact_bits || (facts.filter_bodies && !facts.exact_bodies)};
  for (Buffer<Pair>& part : pairs.parts) {
    std::size_t dropped = 0;
    if (exact_boxes && !test.every_filter) {
      // The boxes decided all.
    } else if (part.size() < least_pairs_a_thread) {
      const ScopedMode mode(exactMode());
      dropped += testRange(test, part.data(), {0, part.size()});
    } else {
      const int team =
          static_cast<int>(std::min<std::size_t>(threads, part.size() / least_pairs_a_thread + 1));
      counts_.assign(team, Count{0});
      ChunkQueue queue(part.size(), chunk_pairs);
      runTeam(team, [&](int thread, int) {
        const ScopedMode mode(exactMode());
        Range range;
        while (queue.next(range)) counts_[thread].dropped += testRange(test, part.data(), range);
      });
      for (const Count& count : counts_) dropped += count.dropped;
    }
    if (facts.user_classes) dropped += callUserTests(geoms, part);
    if (dropped) part.resize(std::remove(part.begin(), part.end(), dropped_pair) - part.begin());
  }
}

}  // namespace ode_parallel_sap
