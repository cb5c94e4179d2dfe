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

Region verifying("filter: verified pairs");

// Copies the pairs that their geoms do not rule out; returns the end of the copy. `user_classes`:
// calls AABBTest functions.
Pair* verifyRun(dxGeom* const* geoms, const PackRules& rules, bool user_classes, const Pair* begin,
                const Pair* end, Pair* to) {
  const PairRule rule(rules);
  // Geoms lie anywhere in memory. The earlier one is often that of the pair before.
  constexpr std::ptrdiff_t ahead = prefetch_distance;
  const auto prefetchFlags = [&](const dxGeom* geom) {
    prefetch(&geom->gflags);
    if (rules.leavesOutResting()) prefetch(&geom->collide_bits);
  };
  for (const Pair* pair = begin; pair < end; ++pair) {
    if (end - pair > 2 * ahead) {
      prefetch(&geoms[laterOf(pair[2 * ahead])]);
      prefetchFlags(geoms[laterOf(pair[ahead])]);
      const Slot earlier = earlierOf(pair[ahead]);
      if (earlier != earlierOf(pair[ahead - 1])) prefetchFlags(geoms[earlier]);
    }
    dxGeom *const a = geoms[earlierOf(*pair)], *const b = geoms[laterOf(*pair)];
    *to = *pair;
    to += rule.passesSilentChanges(a, b) && (!user_classes || passesAABBTests(a, b));
  }
  return to;
}

}  // namespace

PairFilter::PairFilter(dxGeom* const* geoms, const GeomUpdate& update, const PackRules& rules)
    : PairTest(!update.facts().exact_bits || (rules.cull_planes && update.facts().unbounded) ||
               (rules.skip_asleep && !rules.skip_static)),
      geoms_(geoms),
      bodies_(update.boxes().bodies.data()),
      every_filter_(!update.facts().exact_bits),
      asleep_on_static_(rules.skip_asleep && !rules.skip_static),
      packed_bits_at_rest_(rules.notified),
      of_planes_(rules.cull_planes && update.facts().unbounded ? update.states() : nullptr) {}

// Whether the geoms decide otherwise than the boxes did.
bool PairFilter::drops(Pair pair) const {
  const Slot earlier = earlierOf(pair), later = laterOf(pair);
  if (every_filter_ && atRest(earlier) && atRest(later)) return true;
  if (asleep_on_static_ &&
      ((atRest(earlier) && isStatic(later)) || (isStatic(earlier) && atRest(later))))
    return true;
  const bool may_be_clear =
      of_planes_ && ((of_planes_[earlier] | of_planes_[later]) & unbounded_state);
  if (!isMarkedBorderline(pair) && !every_filter_ && !may_be_clear) return false;
  dxGeom *const a = geoms_[earlier], *const b = geoms_[later];
  if (may_be_clear && areClearByPlane(a, b)) return true;
  // The bits of geoms at rest are a matter of verifyPairs(), unless their changes are announced.
  return (isMarkedBorderline(pair) && !boxesOverlap(a, b)) ||
         (every_filter_ && (packed_bits_at_rest_ || !(atRest(earlier) || atRest(later))) &&
          !filtersMatch(a, b));
}

Pair* PairFilter::keep(Pair* begin, Pair* end) const {
  Pair* to = begin;
  for (const Pair* pair = begin; pair < end; ++pair) {
    if ((everyPair() || isMarkedBorderline(*pair)) && drops(*pair)) continue;
    *to++ = *pair & ~borderline_bit;
  }
  return to;
}

// Each thread copies its share to a part of its own.
void verifyPairs(dxGeom* const* geoms, const PackRules& rules, bool user_classes, int threads,
                 const PairList& pairs, PairList& verified) {
  const int most = user_classes ? 1 : teamFor(pairs.size(), grains::tested_pairs, threads);
  verified.clear(static_cast<std::size_t>(most));
  runTeam(verifying, most, [&](int thread, int team) {
    const Range own = ownPart(pairs.size(), thread, team);
    Buffer<Pair>& part = verified.parts[static_cast<std::size_t>(thread)];
    part.resizeDiscarding(own.end - own.begin);
    Pair* to = part.data();
    PairCursor(pairs).read(own.begin, own.end, [&](const Pair* begin, const Pair* end) {
      to = verifyRun(geoms, rules, user_classes, begin, end, to);
    });
    part.resize(static_cast<std::size_t>(to - part.data()));
  });
  verified.addParts(/*decided=*/true);
}

}  // namespace ode_parallel_sap
