// One box or ray against sixteen boxes: overlap, filter, and the pairs that come of it. Internal
// linkage, as in kernels_impl.h.
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
  return {boxes.lower[0], boxes.upper[0], group_size};
}

// Which of sixteen boxes overlap box `lane` of `box`. NaN overlaps nothing. The formula holds for
// inverted boxes too, and so do bounds made of least and greatest ones.
template <class Real>
inline unsigned overlaps(const Group<Real>& box, unsigned lane, const Group<Real>& boxes) {
  return sixteenOf(boxes).overlapping(box, lane);
}

// Which of sixteen boxes may meet box `lane` by their bits and bodies.
inline unsigned passesFilter(const GroupFilter& filter, unsigned lane, const GroupFilter& others) {
  const unsigned wanted = Lanes::sharesBits(others.collide, filter.category[lane]) |
                          Lanes::sharesBits(others.category, filter.collide[lane]);
  return filter.body[lane] ? wanted & ~Lanes::equals(others.body, filter.body[lane]) : wanted;
}

// Writes twice the slots of those of sixteen boxes that overlap box `lane` of `box` and are in
// allowed(hits), 1 more where only the exact boxes can tell: a bound is equal to the opposite one.
// Doubles are the exact bounds. Returns their number; sixteen words are written.
template <class Real, class Allowed>
inline int meetBoxes(const Group<Real>& box, unsigned lane, const Group<Real>& boxes,
                     Allowed allowed, std::uint32_t* found) {
  if constexpr (sizeof(Real) == sizeof(float))
    return Lanes::meetBoxes(box, lane, boxes, allowed, found);
  const unsigned hits = allowed(overlaps(box, lane, boxes));
  Lanes::compress(boxes.slot, hits, found);
  const int count = __builtin_popcount(hits);
  for (int i = 0; i < count; ++i) found[i] *= 2;
  return count;
}

// Both bounds on each axis are moved apart by the margin, so that errors of rounding, which are
// far smaller, leave no box out.
template <class Real>
unsigned meetRay(const Group<Real>& boxes, const RayQuery<Real>& ray, Real limit, Real* entry) {
  using Lane = Register<Real>;
  using Vector = typename Lane::Type;
  for (int first = 0; first < group_size; first += Lane::lanes) {
    Vector lower[3], upper[3], reach{};
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = Lanes::load(boxes.lower[axis] + first) - ray.origin[axis];
      upper[axis] = Lanes::load(boxes.upper[axis] + first) - ray.origin[axis];
      reach = Lane::greatest(Lane::greatest(-lower[axis], upper[axis]), reach);
    }
    const Vector margin = reach * ray.rounding + ray.slack;
    Vector near{}, far = near + limit;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector a = (lower[axis] - margin) * ray.inverse[axis];
      const Vector b = (upper[axis] + margin) * ray.inverse[axis];
      near = Lane::greatest(Lane::least(a, b), near);
      far = Lane::least(Lane::greatest(b, a), far);
    }
    // An unused place is NaN on all axes.
    const Vector none = Vector{} + static_cast<Real>(__builtin_nanf(""));
    *reinterpret_cast<Vector*>(entry + first) =
        ((near <= far) & (lower[0] == lower[0])) ? near : none;
  }
  return Lanes::atLeast(entry, Real(0));
}

}  // namespace
