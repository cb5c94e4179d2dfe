#include "space/filter/pair_filter.h"

#include <algorithm>
#include <atomic>

#include "space/data/floating_point.h"
#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/geom/geom_tests.h"

namespace ode_parallel_sap {

// Whether the geoms decide otherwise than the boxes did.
struct PairFilter::ExactTest {
  dxGeom* const* geoms;
  const std::uint32_t* bodies;  // their numbers
  bool every_filter;            // the filter bits beside the boxes do not decide
  bool asleep_on_static;        // pairs of a geom asleep and a static one are not wanted

  bool everyPair() const { return every_filter || asleep_on_static; }
  bool atRest(Slot slot) const { return bodies[slot] == resting_number; }
  bool isStatic(Slot slot) const { return bodies[slot] == 0 && !IS_SPACE(geoms[slot]); }

  bool drops(Pair pair) const {
    const Slot earlier = earlierOf(pair), later = laterOf(pair);
    if (asleep_on_static &&
        ((atRest(earlier) && isStatic(later)) || (isStatic(earlier) && atRest(later))))
      return true;
    if (!isUnsure(pair) && !every_filter) return false;
    const dxGeom *const a = geoms[earlier], *const b = geoms[later];
    // The bits of geoms at rest are a matter of verify().
    return (isUnsure(pair) && !boxesOverlap(a, b)) ||
           (every_filter && !atRest(earlier) && !atRest(later) && !filtersMatch(a, b));
  }

  // Replaces what it drops, and returns how many.
  std::size_t run(Pair* begin, Pair* end) const;
};

namespace {

constexpr Pair dropped_pair = ~Pair{0};

Region verifying("filter: verified pairs"), testing("filter: exact tests");

}  // namespace

std::size_t PairFilter::ExactTest::run(Pair* begin, Pair* end) const {
  std::size_t dropped = 0;
  for (Pair* pair = begin; pair < end; ++pair) {
    const bool drop = drops(*pair);
    *pair = drop ? dropped_pair : *pair & ~unsure_bit;
    dropped += drop;
  }
  return dropped;
}

void PairFilter::run(dxGeom* const* geoms, const UpdateFacts& facts, const PackRules& rules,
                     const BoxSet& boxes, int threads, PairList& pairs) {
  const ExactTest test = {geoms, boxes.bodies.data(), !facts.exact_bits,
                          rules.skip_asleep && !rules.skip_static};
  if (test.everyPair()) {
    pairs.unsure.clear();
    for (std::size_t part = 0; part < pairs.parts.size(); ++part)
      pairs.unsure.push_back({part, 0, pairs.parts[part].size()});
  }
  if (!testStretches(test, threads, pairs)) return;
  for (Buffer<Pair>& part : pairs.parts)
    part.resize(std::remove(part.begin(), part.end(), dropped_pair) - part.begin());
}

// Marks the pairs whose geoms rule them out.
void PairFilter::verifyChunk(dxGeom* const* geoms, bool user_classes, Pair* begin, Pair* end) {
  constexpr std::ptrdiff_t ahead = prefetch_distance;
  const auto prefetch = [](const dxGeom* geom) {
    __builtin_prefetch(&geom->gflags);
    __builtin_prefetch(&geom->collide_bits);
  };
  for (Pair* pair = begin; pair < end; ++pair) {
    if (end - pair > 2 * ahead) {
      __builtin_prefetch(&geoms[earlierOf(pair[2 * ahead])]);
      __builtin_prefetch(&geoms[laterOf(pair[2 * ahead])]);
      prefetch(geoms[earlierOf(pair[ahead])]);
      prefetch(geoms[laterOf(pair[ahead])]);
    }
    dxGeom *const a = geoms[earlierOf(*pair)], *const b = geoms[laterOf(*pair)];
    if (!isEnabled(a) || !isEnabled(b) || !filtersMatch(a, b) ||
        (user_classes && !passesAABBTests(a, b)))
      *pair = dropped_pair;
  }
}

void PairFilter::verify(dxGeom* const* geoms, const UpdateFacts& facts, int threads,
                        PairList& pairs) {
  for (Buffer<Pair>& part : pairs.parts) {
    const int team = facts.user_classes ? 1 : teamFor(part.size(), grains::looked_up, threads);
    runTeam(verifying, team, [&](int thread, int size) {
      const Range range = ownPart(part.size(), thread, size);
      verifyChunk(geoms, facts.user_classes, part.data() + range.begin, part.data() + range.end);
    });
    part.resize(std::remove(part.begin(), part.end(), dropped_pair) - part.begin());
  }
}

// Stretches are cut into chunks of like size, which threads take as they come.
std::size_t PairFilter::testStretches(const ExactTest& test, int threads, PairList& pairs) {
  chunks_.clear();
  std::size_t count = 0;
  for (const PairList::Stretch& stretch : pairs.unsure) count += stretch.end - stretch.begin;
  const std::size_t most = chunkOf(count, chunk_pairs, threads);
  for (const PairList::Stretch& stretch : pairs.unsure)
    for (std::size_t begin = stretch.begin; begin < stretch.end; begin += most)
      chunks_.push_back({stretch.part, begin, std::min(begin + most, stretch.end)});
  const int team = teamFor(count, grains::geom_tests, threads);
  const ScopedMode mode(exactMode());
  std::atomic<std::size_t> dropped{0};
  ChunkQueue queue(chunks_.size(), 1);
  runTeam(testing, team, [&](int, int) {
    Range range;
    while (queue.next(range)) {
      const PairList::Stretch& chunk = chunks_[range.begin];
      Pair* const part = pairs.parts[chunk.part].data();
      dropped += test.run(part + chunk.begin, part + chunk.end);
    }
  });
  return dropped;
}

}  // namespace ode_parallel_sap
