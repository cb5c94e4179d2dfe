// One box against sixteen: overlap, filter, and the pairs that come of it. Internal linkage, as in
// kernels_impl.h.
#pragma once

#include <string.h>

#include "space/base/box_set.h"
#include "space/simd/kernels.h"

namespace {

using namespace ode_parallel_sap;

constexpr unsigned all_lanes = 0xffff;

template <class Real>
using Row = Lanes::Row<Real>;

template <class Real>
inline Row<Real> rowOf(const Group<Real>& boxes) {
  return Row<Real>(boxes.lower[0], boxes.upper[0], group_size);
}

// Which of sixteen boxes overlap box `lane` of `box`. NaN overlaps nothing. The formula holds for
// inverted boxes too, and so do bounds made of least and greatest ones.
template <class Real>
inline unsigned overlaps(const Group<Real>& box, unsigned lane, const Group<Real>& boxes) {
  return rowOf(boxes).overlapping(box, lane);
}

// Of the `hits` of a row those that only the exact boxes can tell: a bound is equal to the opposite
// one. Doubles are the exact bounds.
template <class Real>
inline unsigned borderlineOf(const Row<Real>& row, const Group<Real>& box, unsigned lane,
                             unsigned hits) {
  if constexpr (sizeof(Real) == sizeof(float)) return hits & row.touching(box, lane);
  return 0;
}

// Which of sixteen boxes may meet box `lane` by their bits and bodies.
inline unsigned passesFilter(const GroupFilter& filter, unsigned lane,
                             const std::uint32_t* category, const std::uint32_t* collide,
                             const std::uint32_t* body) {
  const unsigned wanted = Lanes::sharesBits(collide, filter.category[lane]) |
                          Lanes::sharesBits(category, filter.collide[lane]);
  return filter.body[lane] ? wanted & ~Lanes::equals(body, filter.body[lane]) : wanted;
}

// Sets the top bit of those words, one for each of the hits, that are borderline.
template <class Word>
inline void markBorderline(Word* word, unsigned hits, unsigned borderline) {
  for (; hits; hits &= hits - 1, ++word)
    if (borderline & hits & (0u - hits)) *word |= Word{1} << (8 * sizeof(Word) - 1);
}

// The cell whose boxes are taken one by one.
template <class Real>
struct Query {
  const Group<Real>* boxes;
  const GroupIds* ids;
  const GroupFilter* filter;  // null: no pair is filtered
  unsigned count;             // boxes in use; the others are NaN
  bool exact;

  Query(const TreeView<Real>& tree, std::size_t cell, bool exact)
      : boxes(tree.levels[0] + cell),
        ids(tree.ids + cell),
        filter(tree.filters ? tree.filters + cell : nullptr),
        count(__builtin_popcount(
            Lanes::atMost(boxes->lower[0], static_cast<Real>(__builtin_inff())))),
        exact(exact) {}
};

// What goes with the boxes of a row; without filters the last three are null.
struct RowIds {
  const std::uint32_t *slot, *category, *collide, *body;
};

template <class Real>
inline RowIds idsOf(const TreeView<Real>& tree, std::size_t cell) {
  if (!tree.filters) return {tree.ids[cell].slot, nullptr, nullptr, nullptr};
  const GroupFilter& filter = tree.filters[cell];
  return {tree.ids[cell].slot, filter.category, filter.collide, filter.body};
}

// Pairs of box `lane` of `query` with the `hits` of sixteen boxes.
template <class Real>
inline void writeHits(const Query<Real>& query, unsigned lane, unsigned hits, const Row<Real>& row,
                      const RowIds& ids, PairSink& sink) {
  if (query.filter) {
    hits &= passesFilter(*query.filter, lane, ids.category, ids.collide, ids.body);
    if (!hits) return;
  }
  std::uint64_t* const first = sink.next;
  sink.next += Lanes::writePairs(ids.slot, query.ids->slot[lane], hits, first);
  if (query.exact) return;
  const unsigned borderline = borderlineOf(row, *query.boxes, lane, hits);
  if (borderline) markBorderline(first, hits, borderline);
}

// Pairs of all boxes of `query` with those of sixteen boxes that are in maskOf(lane). A processor
// cannot predict which boxes have hits, so all are met before a pair is written, and it is wrong
// once a row instead of once a hit.
template <class Real, class MaskOf>
inline void boxesAgainstRow(const Query<Real>& query, const Row<Real>& row, const RowIds& ids,
                            MaskOf maskOf, PairSink& sink) {
  unsigned masks[group_size], hit = 0;
  for (unsigned lane = 0; lane < query.count; ++lane) {
    masks[lane] = row.overlapping(*query.boxes, lane) & maskOf(lane);
    hit |= unsigned{masks[lane] != 0} << lane;
  }
  for (; hit; hit &= hit - 1) {
    const unsigned lane = static_cast<unsigned>(__builtin_ctz(hit));
    writeHits(query, lane, masks[lane], row, ids, sink);
  }
}

inline void makeRoom(PairSink& sink, std::size_t room) {
  if (static_cast<std::size_t>(sink.end - sink.next) < room) sink.grow(sink, room);
}

}  // namespace
