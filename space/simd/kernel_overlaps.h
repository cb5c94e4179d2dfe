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

template <class Real>
inline std::uint32_t greatestSlot(const Group<Real>& boxes) {
  std::uint32_t greatest = boxes.slot[0];
  for (const std::uint32_t slot : boxes.slot) greatest = slot > greatest ? slot : greatest;
  return greatest;
}

// Which of sixteen boxes may meet box `lane` by their bits and bodies.
inline unsigned passesFilter(const GroupFilter& filter, unsigned lane, const GroupFilter& others) {
  const unsigned wanted = Lanes::sharesBits(others.collide, filter.category[lane]) |
                          Lanes::sharesBits(others.category, filter.collide[lane]);
  return filter.body[lane] ? wanted & ~Lanes::equals(others.body, filter.body[lane]) : wanted;
}

// Writes the slots of the `hits` of sixteen boxes with box `lane` of `box`, with borderline_slot
// where only the exact boxes can tell: a bound is equal to the opposite one. Doubles are the exact
// bounds. Returns their number; up to sixteen words are written.
template <class Real>
inline int writeHits(const Group<Real>& box, unsigned lane, const Sixteen<Real>& boxes,
                     const std::uint32_t* slots, unsigned hits, std::uint32_t* found) {
  Lanes::compress(slots, hits, found);
  unsigned borderline = 0;
  if constexpr (sizeof(Real) == sizeof(float)) borderline = hits & boxes.touching(box, lane);
  for (unsigned left = borderline ? hits : 0; left; left &= left - 1, ++found)
    if (borderline & left & (0u - left)) *found |= borderline_slot;
  return __builtin_popcount(hits);
}

}  // namespace
