#include "space/geoms/pair_filter.h"

#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

// Whether the geoms decide otherwise than the boxes did.
struct PairFilter::ExactTest {
  dxGeom* const* geoms;
  const std::uint32_t* bodies;  // their numbers
  bool every_filter;            // the filter bits beside the boxes do not decide
  bool asleep_on_static;        // pairs of a geom asleep and a static one are not wanted
  bool packed_bits_at_rest;     // geoms at rest have their own bits

  bool everyPair() const { return every_filter || asleep_on_static; }
  bool atRest(Slot slot) const { return bodies[slot] == resting_number; }
  bool isStatic(Slot slot) const { return bodies[slot] == 0 && !IS_SPACE(geoms[slot]); }

  bool drops(Pair pair) const {
    const Slot earlier = earlierOf(pair), later = laterOf(pair);
    if (asleep_on_static &&
        ((atRest(earlier) && isStatic(later)) || (isStatic(earlier) && atRest(later))))
      return true;
    if (!isMarkedBorderline(pair) && !every_filter) return false;
    const dxGeom *const a = geoms[earlier], *const b = geoms[later];
    // The bits of geoms at rest are a matter of verify(), unless their changes are announced.
    return (isMarkedBorderline(pair) && !boxesOverlap(a, b)) ||
           (every_filter && (packed_bits_at_rest || !(atRest(earlier) || atRest(later))) &&
            !filtersMatch(a, b));
  }

  // Replaces what it drops by dropped_pair; returns whether it dropped any.
  bool markDropped(Pair* begin, Pair* end) const;
};

namespace {

// Stands in the place of a pair that is to go.
constexpr Pair dropped_pair = ~Pair{0};

Region verifying("filter: verified pairs"), testing("filter: exact tests"), closing("filter: gaps"),
    moving("filter: pieces");

}  // namespace

bool PairFilter::ExactTest::markDropped(Pair* begin, Pair* end) const {
  bool any = false;
  for (Pair* pair = begin; pair < end; ++pair) {
    const bool drop = drops(*pair);
    *pair = drop ? dropped_pair : *pair & ~borderline_bit;
    any |= drop;
  }
  return any;
}

void PairFilter::dropExcluded(dxGeom* const* geoms, const UpdateFacts& facts,
                              const PackRules& rules, const BoxSet& boxes, int threads,
                              PairList& pairs) {
  const ExactTest test = {geoms, boxes.bodies.data(), !facts.exact_bits,
                          rules.skip_asleep && !rules.skip_static, rules.notified};
  if (test.everyPair()) {
    pairs.borderline.clear();
    for (std::size_t part = 0; part < pairs.parts.size(); ++part)
      pairs.borderline.push_back({part, 0, pairs.parts[part].size()});
  }
  testSegments(test, threads, pairs);
  closeGaps(threads, pairs);
}

// Copies the pairs that their geoms do not rule out; returns the end of the copy. `user_classes`:
// calls AABBTest functions.
Pair* PairFilter::verifyRun(dxGeom* const* geoms, const PackRules& rules, bool user_classes,
                            const Pair* begin, const Pair* end, Pair* to) {
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
    to += rule.isStillPair(a, b) && (!user_classes || passesAABBTests(a, b, rules.tested_classes));
  }
  return to;
}

const PairList& PairFilter::select(dxGeom* const* geoms, const UpdateFacts& facts,
                                   const PackRules& rules, const BoxSet& boxes, int threads,
                                   const PairList& candidates, Selected& selected) {
  selected.added = 0;
  const bool planes_apart = planesApart(rules);
  const PairList* others = &candidates;
  if (needsVerifying(facts, rules)) {
    PairList& verified = planes_apart ? selected.verified : selected.pairs;
    verify(geoms, rules, facts.user_classes, threads, candidates, verified);
    others = &verified;
  }
  if (planes_apart)
    selected.added =
        planes_.addTo(*others, {geoms, boxes, rules, facts.user_classes}, threads, selected.pairs);
  return selected.pairs;
}

// Puts into `verified`, another list, the pairs to be reported.
void PairFilter::verify(dxGeom* const* geoms, const PackRules& rules, bool user_classes,
                        int threads, const PairList& pairs, PairList& verified) {
  const std::size_t count = pairs.size();
  const int team = user_classes ? 1 : teamFor(count, grains::looked_up, threads);
  verified.clear(static_cast<std::size_t>(team));
  runTeam(verifying, team, [&](int thread, int size) {
    const Range own = ownPart(count, thread, size);
    Buffer<Pair>& part = verified.parts[static_cast<std::size_t>(thread)];
    part.resizeDiscarding(own.end - own.begin);
    Pair* to = part.data();
    PairCursor(pairs).read(own.begin, own.end, [&](const Pair* run, const Pair* run_end) {
      to = verifyRun(geoms, rules, user_classes, run, run_end, to);
    });
    part.resize(static_cast<std::size_t>(to - part.data()));
  });
}

// Long segments are cut, so that what threads take as they come is of like size.
void PairFilter::testSegments(const ExactTest& test, int threads, PairList& pairs) {
  clearForTeam(gaps_, 0);
  std::size_t count = 0;
  for (const PairList::Segment& segment : pairs.borderline) count += segment.end - segment.begin;
  if (count == 0) return;
  const std::size_t most = chunkOf(count, chunk_pairs, threads);
  pieces_to_test_.clear();
  for (const PairList::Segment& segment : pairs.borderline)
    for (std::size_t begin = segment.begin; begin < segment.end; begin += most)
      pieces_to_test_.push_back({segment.part, begin, std::min(begin + most, segment.end)});
  const std::size_t pieces = pieces_to_test_.size();
  const int team = teamFor(count, grains::geom_tests, threads);
  clearForTeam(gaps_, team);
  const ScopedMode mode(exactMode());
  const std::size_t chunk = std::max<std::size_t>(pieces * most / count, 1);
  runChunks(testing, team, pieces, chunk, [&](const Range& range, int thread) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const PairList::Segment& piece = pieces_to_test_[i];
      Pair* const part = pairs.parts[piece.part].data();
      if (test.markDropped(part + piece.begin, part + piece.end)) gaps_[thread].push_back(piece);
    }
  });
}

// Takes the dropped pairs out, from the first one of each part on. Each thread closes the gaps of a
// piece. Then all pieces move together: the head of a piece, which lands in the piece before, is
// put aside until that one has moved.
void PairFilter::closeGaps(int threads, PairList& pairs) {
  for (std::size_t i = 0; i < pairs.parts.size(); ++i) {
    Buffer<Pair>& part = pairs.parts[i];
    std::size_t first = part.size();
    for (const auto& of_thread : gaps_)
      for (const PairList::Segment& gap : of_thread)
        if (gap.part == i) first = std::min(first, gap.begin);
    if (first == part.size()) continue;
    const std::size_t count = part.size() - first;
    const int most = teamFor(count, grains::passed_pairs, threads);
    pieces_.assign(static_cast<std::size_t>(most), Piece());
    runTeam(closing, most, [&](int thread, int team) {
      const Range own = ownPart(count, thread, team);
      Pair* const begin = part.data() + first + own.begin;
      Pair* const end = std::remove(begin, part.data() + first + own.end, dropped_pair);
      pieces_[thread] = {begin, end, nullptr, {}};
    });
    Pair* to = part.data() + first;
    for (Piece& piece : pieces_) {
      piece.to = to;
      to += piece.end - piece.begin;
    }
    runTeam(moving, most, [&](int thread, int) {
      Piece& piece = pieces_[thread];
      noteWork();
      if (piece.begin == piece.end || piece.begin == piece.to) return;
      Pair* const rest = std::min(piece.end, piece.begin + (piece.begin - piece.to));
      piece.head.assign(piece.begin, rest);
      std::copy(rest, piece.end, piece.to + piece.head.size());
    });
    for (const Piece& piece : pieces_) std::copy(piece.head.begin(), piece.head.end(), piece.to);
    part.resize(static_cast<std::size_t>(to - part.data()));
  }
}

}  // namespace ode_parallel_sap
