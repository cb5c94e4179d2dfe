// What still decides about a pair of overlapping boxes: filters, and whether floats can be trusted.
#pragma once

#include <algorithm>

#include "space/base/box_set.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Whether only the exact boxes can tell that two overlap whose float bounds do: a bound is equal to
// the opposite one. Doubles are the exact bounds.
template <class Real>
inline bool isBorderline(const BasicBox<Real>& a, const BasicBox<Real>& b) {
  Real gap = a.lower[0] - b.upper[0];
  for (int axis = 0; axis < 3; ++axis)
    gap = std::max(std::max(gap, a.lower[axis] - b.upper[axis]), b.lower[axis] - a.upper[axis]);
  return sizeof(Real) == sizeof(float) && gap == 0;
}

inline bool passesFilters(const BoxSet& boxes, Slot a, Slot b) {
  if (boxes.filter_bits && !(boxes.bits[a].category & boxes.bits[b].collide) &&
      !(boxes.bits[b].category & boxes.bits[a].collide))
    return false;
  return !boxes.filter_bodies || !boxes.bodies[a] || boxes.bodies[a] != boxes.bodies[b];
}

// Writes the pair of two slots whose boxes overlap, if it passes the filters, to *to. Returns what
// comes after it.
inline Pair* writePair(const BoxSet& boxes, Slot a, Slot b, Pair* to) {
  if (!passesFilters(boxes, a, b)) return to;
  *to = a < b ? makePair(a, b) : makePair(b, a);
  if (!boxes.exact && !boxes.wide && isBorderline(boxes.boxes[a], boxes.boxes[b]))
    *to |= borderline_bit;
  return to + 1;
}

}  // namespace ode_parallel_sap
