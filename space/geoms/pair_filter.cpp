#include "space/geoms/pair_filter.h"

#include <algorithm>

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
Pair* verifyRun(dxGeom* const* geoms, const PairRules& rules, bool user_classes, const Pair* begin,
                const Pair* end, Pair* to) {
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
    to += rules.passesSilentChanges(a, b) && (!user_classes || passesAABBTests(a, b));
  }
  return to;
}

}  // namespace

PairFilter::PairFilter(dxGeom* const* geoms, const GeomUpdate& update, const PairRules& rules)
    : PairTest(!update.facts().exact_bits || (rules.cull_planes && update.facts().unbounded) ||
               (rules.skip_asleep && !rules.skip_static)),
      geoms_(geoms),
      update_(update),
      rules_(rules) {}

// Whether the geoms decide otherwise than the boxes did.
bool PairFilter::drops(Pair pair) const {
  const Slot earlier = earlierOf(pair), later = laterOf(pair);
  dxGeom *const a = geoms_[earlier], *const b = geoms_[later];
  if (isMarkedBorderline(pair) && !boxesOverlap(a, b)) return true;
  if (!everyPair()) return false;
  const BodyKey* const bodies = update_.boxes().bodies.data();
  const bool a_rests = bodies[earlier] == resting_body, b_rests = bodies[later] == resting_body;
  // Static geoms that are left out rest, too.
  if ((a_rests && !bodies[later] && !IS_SPACE(b)) || (b_rests && !bodies[earlier] && !IS_SPACE(a)))
    return true;
  const SlotState* const states = update_.states();
  if (rules_.cull_planes && (states[earlier] | states[later]) & unbounded_state &&
      areClearByPlane(a, b))
    return true;
  // The bits of geoms at rest are a matter of verifyPairs(), unless their changes are announced.
  return !update_.facts().exact_bits && (rules_.notified || !(a_rests || b_rests)) &&
         !filtersMatch(a, b);
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
void verifyPairs(dxGeom* const* geoms, const PairRules& rules, bool user_classes, int threads,
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
