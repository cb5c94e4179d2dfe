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
using Sixteen = Lanes::Sixteen<Real>;

template <class Real>
inline Sixteen<Real> sixteenOf(const Group<Real>& boxes) {
  return Sixteen<Real>(boxes.lower[0], boxes.upper[0], group_size);
}

// Which of sixteen boxes overlap box `lane` of `box`. NaN overlaps nothing. The formula holds for
// inverted boxes too, and so do bounds made of least and greatest ones.
template <class Real>
inline unsigned overlaps(const Group<Real>& box, unsigned lane, const Group<Real>& boxes) {
  return sixteenOf(boxes).overlapping(box, lane);
}

// The slot of sixteen that comes before all others.
template <class Real, class Before>
inline std::uint32_t slotOf(const Group<Real>& boxes, Before before) {
  std::uint32_t first = boxes.slot[0];
  for (int lane = 1; lane < group_size; ++lane)
    first = before(boxes.slot[lane], first) ? boxes.slot[lane] : first;
  return first;
}
template <class Real>
inline std::uint32_t leastSlot(const Group<Real>& boxes) {
  return slotOf(boxes, [](std::uint32_t a, std::uint32_t b) { return a < b; });
}
template <class Real>
inline std::uint32_t greatestSlot(const Group<Real>& boxes) {
  return slotOf(boxes, [](std::uint32_t a, std::uint32_t b) { return a > b; });
}

// Of the `hits` of sixteen boxes those that only the exact boxes can tell: a bound is equal to the
// opposite one. Doubles are the exact bounds.
template <class Real>
inline unsigned borderlineOf(const Sixteen<Real>& boxes, const Group<Real>& box, unsigned lane,
                             unsigned hits) {
  if constexpr (sizeof(Real) == sizeof(float)) return hits & boxes.touching(box, lane);
  return 0;
}

// Which of sixteen boxes may meet box `lane` by their bits and bodies.
inline unsigned passesFilter(const GroupFilter& filter, unsigned lane, const GroupFilter& others) {
  const unsigned wanted = Lanes::sharesBits(others.collide, filter.category[lane]) |
                          Lanes::sharesBits(others.category, filter.collide[lane]);
  return filter.body[lane] ? wanted & ~Lanes::equals(others.body, filter.body[lane]) : wanted;
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
  const GroupFilter* filter;  // null: no pair is filtered
  unsigned count;             // boxes in use; the others are NaN
  bool exact;

  Query(const TreeView<Real>& tree, std::size_t cell, bool exact)
      : boxes(tree.levels[0] + cell),
        filter(tree.filters ? tree.filters + cell : nullptr),
        count(__builtin_popcount(
            Lanes::atMost(boxes->lower[0], static_cast<Real>(__builtin_inff())))),
        exact(exact) {}
};

// Pairs of box `lane` of `query` with the `hits` of a cell.
template <class Real>
inline void writeHits(const Query<Real>& query, unsigned lane, unsigned hits,
                      const TreeView<Real>& tree, std::size_t cell, PairSink& sink) {
  if (query.filter) {
    hits &= passesFilter(*query.filter, lane, tree.filters[cell]);
    if (!hits) return;
  }
  const Group<Real>& boxes = tree.levels[0][cell];
  std::uint64_t* const first = sink.next;
  sink.next += Lanes::writePairs(boxes.slot, query.boxes->slot[lane], hits, first);
  if (query.exact) return;
  const unsigned borderline = borderlineOf(sixteenOf(boxes), *query.boxes, lane, hits);
  if (borderline) markBorderline(first, hits, borderline);
}

inline void makeRoom(PairSink& sink, std::size_t room) {
  if (static_cast<std::size_t>(sink.end - sink.next) < room) sink.grow(sink, room);
}

}  // namespace
