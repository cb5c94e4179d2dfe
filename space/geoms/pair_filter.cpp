#include "space/geoms/pair_filter.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

// Stands in the place of a pair that is to go.
constexpr Pair dropped_pair = ~Pair{0};

Region verifying("filter: verified pairs"), testing("filter: exact tests"), closing("filter: gaps");

// Whether the geoms decide otherwise than the boxes did.
struct ExactTest {
  dxGeom* const* geoms;
  const BodyKey* bodies;       // by slot
  bool every_filter;           // the bits beside the boxes do not decide
  bool asleep_on_static;       // pairs of a geom asleep and a static one are not wanted
  bool packed_bits_at_rest;    // geoms at rest have their own bits
  const SlotState* of_planes;  // by slot, unbounded_state where planes are; null: not culled

  bool everyPair() const { return every_filter || asleep_on_static || of_planes; }
  bool atRest(Slot slot) const { return bodies[slot] == resting_body; }
  bool isStatic(Slot slot) const { return bodies[slot] == 0 && !IS_SPACE(geoms[slot]); }

  bool drops(Pair pair) const {
    const Slot earlier = earlierOf(pair), later = laterOf(pair);
    if (every_filter && atRest(earlier) && atRest(later)) return true;
    if (asleep_on_static &&
        ((atRest(earlier) && isStatic(later)) || (isStatic(earlier) && atRest(later))))
      return true;
    const bool may_be_clear =
        of_planes && ((of_planes[earlier] | of_planes[later]) & unbounded_state);
    if (!isMarkedBorderline(pair) && !every_filter && !may_be_clear) return false;
    dxGeom *const a = geoms[earlier], *const b = geoms[later];
    if (may_be_clear && areClearByPlane(a, b)) return true;
    // The bits of geoms at rest are a matter of verify(), unless their changes are announced.
    return (isMarkedBorderline(pair) && !boxesOverlap(a, b)) ||
           (every_filter && (packed_bits_at_rest || !(atRest(earlier) || atRest(later))) &&
            !filtersMatch(a, b));
  }

  // Replaces what it drops by dropped_pair; returns whether it dropped any.
  bool markDropped(Pair* begin, Pair* end) const {
    bool any = false;
    for (Pair* pair = begin; pair < end; ++pair) {
      const bool drop = drops(*pair);
      *pair = drop ? dropped_pair : *pair & ~borderline_bit;
      any |= drop;
    }
    return any;
  }
};

// Returns whether any pair is dropped.
bool testSegments(const ExactTest& test, int threads, PairList& pairs) {
  std::size_t count = 0;
  for (const PairList::Segment& segment : pairs.borderline) count += segment.end - segment.begin;
  if (count == 0) return false;
  const std::size_t segments = pairs.borderline.size();
  const int team = teamFor(count, grains::geom_tests, threads);
  const std::size_t pairs_at_once = chunkOf(count, chunk_pairs, threads);
  const std::size_t chunk = std::max<std::size_t>(segments * pairs_at_once / count, 1);
  std::atomic<bool> any{false};
  const ScopedMode mode(exactMode());
  runChunks(testing, team, segments, chunk, [&](const Range& range, int) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const PairList::Segment& segment = pairs.borderline[i];
      Pair* const part = pairs.parts[segment.part].data();
      if (test.markDropped(part + segment.begin, part + segment.end)) any = true;
    }
  });
  return any;
}

// Each thread copies its share of the pairs to a part of its own: copy(begin, end, to), for the
// runs of its share, returns the end of the copy.
template <class Copy>
void copyRuns(Region& region, int team, const PairList& pairs, PairList& copied, Copy copy) {
  copied.clear(static_cast<std::size_t>(team));
  runTeam(region, team, [&](int thread, int size) {
    const Range own = ownPart(pairs.size(), thread, size);
    Buffer<Pair>& part = copied.parts[static_cast<std::size_t>(thread)];
    part.resizeDiscarding(own.end - own.begin);
    Pair* to = part.data();
    PairCursor(pairs).read(own.begin, own.end,
                           [&](const Pair* begin, const Pair* end) { to = copy(begin, end, to); });
    part.resize(static_cast<std::size_t>(to - part.data()));
  });
}

// Copies the pairs that their geoms do not rule out; returns the end of the copy. `user_classes`:
// calls AABBTest functions.
Pair* verifyRun(dxGeom* const* geoms, const PackRules& rules, bool user_classes, const Pair* begin,
                const Pair* end, Pair* to) {
  const PairRule rule(rules);
  // Geoms lie anywhere in memory. The earlier one is often that of the pair before.
  constexpr std::ptrdiff_t ahead = prefetch_distance;
  const auto askFor = [&](const dxGeom* geom) {
    prefetch(&geom->gflags);
    if (rules.skip()) prefetch(&geom->collide_bits);
  };
  for (const Pair* pair = begin; pair < end; ++pair) {
    if (end - pair > 2 * ahead) {
      prefetch(&geoms[laterOf(pair[2 * ahead])]);
      askFor(geoms[laterOf(pair[ahead])]);
      const Slot earlier = earlierOf(pair[ahead]);
      if (earlier != earlierOf(pair[ahead - 1])) askFor(geoms[earlier]);
    }
    dxGeom *const a = geoms[earlierOf(*pair)], *const b = geoms[laterOf(*pair)];
    *to = *pair;
    to += rule.isStillPair(a, b) && (!user_classes || passesAABBTests(a, b));
  }
  return to;
}

}  // namespace

void PairFilter::dropExcluded(dxGeom* const* geoms, const GeomUpdate& update,
                              const PackRules& rules, bool planes, int threads, PairList& pairs) {
  const UpdateFacts& facts = update.facts();
  const ExactTest test = {geoms,
                          update.boxes().bodies.data(),
                          !facts.exact_bits,
                          rules.skip_asleep && !rules.skip_static,
                          rules.notified,
                          planes && facts.unbounded ? update.states() : nullptr};
  if (test.everyPair()) {
    const std::size_t most = chunkOf(pairs.size(), chunk_pairs, threads);
    pairs.borderline.clear();
    for (std::size_t part = 0; part < pairs.parts.size(); ++part)
      for (std::size_t begin = 0, end; begin < pairs.parts[part].size(); begin = end) {
        end = std::min(begin + most, pairs.parts[part].size());
        pairs.borderline.push_back({part, begin, end});
      }
  }
  if (testSegments(test, threads, pairs)) closeGaps(threads, pairs);
}

void PairFilter::verify(dxGeom* const* geoms, const PackRules& rules, bool user_classes,
                        int threads, const PairList& pairs, PairList& verified) {
  const int team = user_classes ? 1 : teamFor(pairs.size(), grains::looked_up, threads);
  copyRuns(verifying, team, pairs, verified, [&](const Pair* begin, const Pair* end, Pair* to) {
    return verifyRun(geoms, rules, user_classes, begin, end, to);
  });
}

// Takes the dropped pairs out.
void PairFilter::closeGaps(int threads, PairList& pairs) {
  const int team = teamFor(pairs.size(), grains::passed_pairs, threads);
  copyRuns(closing, team, pairs, closed_, [](const Pair* begin, const Pair* end, Pair* to) {
    return std::remove_copy(begin, end, to, dropped_pair);
  });
  std::swap(pairs, closed_);
}

}  // namespace ode_parallel_sap
