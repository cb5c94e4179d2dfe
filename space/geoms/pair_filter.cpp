#include "space/geoms/pair_filter.h"

#include <algorithm>
#include <cstring>

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
  const SlotState* of_planes;   // by slot, unbounded_state where planes are; null: not culled

  bool everyPair() const { return every_filter || asleep_on_static || of_planes; }
  bool atRest(Slot slot) const { return bodies[slot] == resting_number; }
  bool isStatic(Slot slot) const { return bodies[slot] == 0 && !IS_SPACE(geoms[slot]); }

  bool drops(Pair pair) const {
    const Slot earlier = earlierOf(pair), later = laterOf(pair);
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

  // Replaces what it drops by dropped_pair; returns how many it dropped.
  std::uint32_t markDropped(Pair* begin, Pair* end) const;
};

namespace {

// Stands in the place of a pair that is to go.
constexpr Pair dropped_pair = ~Pair{0};

Region verifying("filter: verified pairs"), testing("filter: exact tests"), closing("filter: gaps");

}  // namespace

std::uint32_t PairFilter::ExactTest::markDropped(Pair* begin, Pair* end) const {
  std::uint32_t dropped = 0;
  for (Pair* pair = begin; pair < end; ++pair) {
    const bool drop = drops(*pair);
    *pair = drop ? dropped_pair : *pair & ~borderline_bit;
    dropped += drop;
  }
  return dropped;
}

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
    pairs.borderline.clear();
    for (std::size_t part = 0; part < pairs.parts.size(); ++part)
      pairs.borderline.push_back({part, 0, pairs.parts[part].size()});
  }
  if (!testSegments(test, threads, pairs)) return;
  for (std::size_t i = 0; i < pairs.parts.size(); ++i)
    closeGaps(threads, pairs.parts[i], dropped_[i]);
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
    to += rule.isStillPair(a, b) && (!user_classes || passesAABBTests(a, b));
  }
  return to;
}

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

// Segments are cut at the ends of blocks, so that what threads take as they come is of like size.
// Counts what was dropped in each block; false if there was nothing to test.
bool PairFilter::testSegments(const ExactTest& test, int threads, PairList& pairs) {
  std::size_t count = 0;
  for (const PairList::Segment& segment : pairs.borderline) count += segment.end - segment.begin;
  if (count == 0) return false;
  block_ = chunkOf(count, chunk_pairs, threads);
  if (dropped_.size() < pairs.parts.size()) dropped_.resize(pairs.parts.size());
  for (std::size_t i = 0; i < pairs.parts.size(); ++i) {
    dropped_[i].resizeDiscarding((pairs.parts[i].size() + block_ - 1) / block_);
    std::fill(dropped_[i].begin(), dropped_[i].end(), 0);
  }
  pieces_to_test_.clear();
  for (const PairList::Segment& segment : pairs.borderline)
    for (std::size_t begin = segment.begin, end; begin < segment.end; begin = end) {
      end = std::min((begin / block_ + 1) * block_, segment.end);
      pieces_to_test_.push_back({segment.part, begin, end});
    }
  const std::size_t pieces = pieces_to_test_.size();
  const int team = teamFor(count, grains::geom_tests, threads);
  const ScopedMode mode(exactMode());
  const std::size_t chunk = std::max<std::size_t>(pieces * block_ / count, 1);
  runChunks(testing, team, pieces, chunk, [&](const Range& range, int) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const PairList::Segment& piece = pieces_to_test_[i];
      Pair* const part = pairs.parts[piece.part].data();
      if (const std::uint32_t dropped = test.markDropped(part + piece.begin, part + piece.end))
        addShared(dropped_[piece.part][piece.begin / block_], dropped);
    }
  });
  return true;
}

// Takes the dropped pairs out, of which there are so many in each block. Each thread moves its
// blocks to where they belong; the first of these pairs, which land ahead of the blocks, are put
// aside until all have moved.
void PairFilter::closeGaps(int threads, Buffer<Pair>& part, Buffer<std::uint32_t>& dropped) {
  const std::size_t count = part.size();
  std::size_t all = 0;
  for (const std::uint32_t of_block : dropped) all += of_block;
  if (all == 0) return;
  const int most = teamFor(count, grains::passed_pairs, threads);
  pieces_.assign(static_cast<std::size_t>(most), Piece());
  runTeam(closing, most, [&](int thread, int team) {
    const Range own = ownPart(dropped.size(), thread, team);
    std::size_t ahead = 0;
    for (std::size_t block = 0; block < own.begin; ++block) ahead += dropped[block];
    Pair* to = part.data() + own.begin * block_;
    Piece& piece = pieces_[thread];
    piece.to = to - ahead;
    const auto move = [&](Pair* begin, Pair* end) {
      Pair* const rest = begin + std::min<std::size_t>(end - begin, ahead - piece.head.size());
      piece.head.insert(piece.head.end(), begin, rest);
      if (rest != to) std::memmove(to, rest, (end - rest) * sizeof(Pair));
      to += end - rest;
    };
    for (std::size_t block = own.begin; block < own.end; ++block) {
      Pair* begin = part.data() + block * block_;
      Pair* const end = part.data() + std::min((block + 1) * block_, count);
      for (std::uint32_t left = dropped[block]; left; --left) {
        Pair* const gap = std::find(begin, end, dropped_pair);
        move(begin, gap);
        begin = gap + 1;
      }
      move(begin, end);
    }
  });
  for (const Piece& piece : pieces_) std::copy(piece.head.begin(), piece.head.end(), piece.to);
  part.resize(count - all);
}

}  // namespace ode_parallel_sap
