#include "space/geoms/pair_gaps.h"

#include <algorithm>
#include <cstring>

#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region closing("pair gaps: within pieces"), moving("pair gaps: moved pieces"),
    joining("pair gaps: moved heads");

void movePairs(const Pair* from, std::size_t count, Pair* to) {
  if (count && from != to) std::memmove(to, from, count * sizeof(Pair));
}

// What is left of `range`, which the gaps from `gap` on lie in or beyond, moves to its beginning.
// Returns how many pairs that are.
std::size_t closeRange(const Range& range, const PairList::Segment* gap,
                       const PairList::Segment* last_gap, Pair* pairs) {
  Pair* to = pairs + range.begin;
  std::size_t at = range.begin;
  for (; gap < last_gap && gap->begin < range.end; ++gap) {
    const std::size_t begin = std::max(gap->begin, range.begin);
    const std::size_t end = std::min(gap->end, range.end);
    movePairs(pairs + at, begin - at, to);
    to = moveKept(pairs + begin, pairs + end, to + (begin - at));
    at = end;
  }
  movePairs(pairs + at, range.end - at, to);
  return static_cast<std::size_t>(to - pairs) + (range.end - at) - range.begin;
}

}  // namespace

Pair* moveKept(const Pair* begin, const Pair* end, Pair* to) {
  for (const Pair* pair = begin; pair < end; ++pair) {
    *to = *pair;
    to += *pair != dropped_pair;
  }
  return to;
}

void PairGaps::close(std::vector<PairList::Segment>& gaps, int threads, PairList& pairs) {
  std::sort(gaps.begin(), gaps.end(), [](const PairList::Segment& a, const PairList::Segment& b) {
    return a.part != b.part ? a.part < b.part : a.begin < b.begin;
  });
  const Gap last = gaps.data() + gaps.size();
  for (Gap begin = gaps.data(); begin < last;) {
    Gap end = begin;
    while (end < last && end->part == begin->part) ++end;
    closePart(begin, end, threads, pairs.parts[begin->part]);
    begin = end;
  }
}

// In place: each thread closes the gaps of a piece of its own, then all pieces are moved together.
void PairGaps::closePart(Gap begin, Gap end, int threads, Buffer<Pair>& part) {
  const std::size_t first = begin->begin, count = part.size() - first;
  const int team = teamFor(count, grains::passed_pairs, threads);
  pieces_.assign(static_cast<std::size_t>(team), {part.size(), part.size(), 0});
  runTeam(closing, team, [&](int thread, int size) {
    Range range = ownPart(count, thread, size);
    range.begin += first;
    range.end += first;
    const Gap gap =
        std::partition_point(begin, end, [&](const auto& g) { return g.end <= range.begin; });
    pieces_[thread] = {range.begin, range.end, closeRange(range, gap, end, part.data())};
  });
  join(pieces_, team, part);
}

// The head of a piece, as many pairs as were dropped before it, lands in the pieces before. So
// heads are put aside while the rest of each piece moves within it, and written when all have.
void PairGaps::join(const std::vector<Piece>& pieces, int threads, Buffer<Pair>& part) {
  if (pieces.empty()) return;
  const int count = static_cast<int>(pieces.size());
  targets_.resize(pieces.size() + 1);
  targets_[0] = pieces[0].begin;
  std::size_t all_heads = 0;
  const auto headOf = [&](int i) {
    return std::min(pieces[i].begin - targets_[i], pieces[i].kept);
  };
  for (int i = 0; i < count; ++i) {
    targets_[i + 1] = targets_[i] + pieces[i].kept;
    all_heads += headOf(i);
  }
  if (targets_[count] == part.size()) return;
  heads_.resizeDiscarding(all_heads);
  Pair* const pairs = part.data();
  // Calls use(i, its head's place in heads_) for the pieces in turn.
  const auto share = [&](Region& region, auto use) {
    runTeam(region, threads, [&](int thread, int team) {
      const Range own = ownPart(pieces.size(), thread, team);
      std::size_t head = 0;
      for (int i = 0; i < static_cast<int>(own.end); ++i) {
        if (i >= static_cast<int>(own.begin)) use(i, heads_.data() + head);
        head += headOf(i);
      }
    });
  };
  share(moving, [&](int i, Pair* head) {
    const Pair* const from = pairs + pieces[i].begin;
    movePairs(from, headOf(i), head);
    movePairs(from + headOf(i), pieces[i].kept - headOf(i), pairs + targets_[i] + headOf(i));
  });
  share(joining, [&](int i, const Pair* head) { movePairs(head, headOf(i), pairs + targets_[i]); });
  part.resize(targets_[count]);
}

}  // namespace ode_parallel_sap
