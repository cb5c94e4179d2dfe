// Boxes against half-spaces. Internal linkage, as in kernels_impl.h.
#pragma once

#include "space/simd/kernel_overlaps.h"

namespace {

template <class Real>
inline void packBoxes(Group<Real>& group, const BasicBox<Real>* boxes, std::size_t count) {
  const Real nan = static_cast<Real>(__builtin_nanf(""));
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t lane = 0; lane < group_size; ++lane) {
      group.lower[axis][lane] = lane < count ? boxes[lane].lower[axis] : nan;
      group.upper[axis][lane] = lane < count ? boxes[lane].upper[axis] : nan;
    }
}

// On each axis the greatest magnitude of the bounds of sixteen boxes.
template <class Real>
struct Magnitudes {
  double greatest[3];

  explicit Magnitudes(const Group<Real>& boxes) {
    for (int axis = 0; axis < 3; ++axis) {
      alignas(64) Real lanes[group_size];
      for (int lane = 0; lane < group_size; ++lane) {
        const Real lower = magnitude(boxes.lower[axis][lane]);
        const Real upper = magnitude(boxes.upper[axis][lane]);
        lanes[lane] = lower > 0 ? lower : 0;  // NaN is not greater
        lanes[lane] = upper > lanes[lane] ? upper : lanes[lane];
      }
      greatest[axis] = Lanes::greatest(lanes);
    }
  }
  static Real magnitude(Real bound) { return bound < 0 ? -bound : bound; }
  // Larger bounds may stand for any beyond the type, infinite or not.
  static bool isKnown(double magnitude) {
    return magnitude <= (sizeof(Real) > sizeof(float) ? __DBL_MAX__ : __FLT_MAX__) / 2;
  }
  bool areKnown() const {
    return isKnown(greatest[0]) && isKnown(greatest[1]) && isKnown(greatest[2]);
  }
};

// Makes all bounds 0 of those boxes of which some bound is not known, and returns the other ones.
template <class Real>
inline unsigned keepKnown(Group<Real>& boxes) {
  unsigned known = 0;
  for (int lane = 0; lane < group_size; ++lane) {
    bool is_known = true;
    for (int axis = 0; axis < 3; ++axis) {
      const Real lower = Magnitudes<Real>::magnitude(boxes.lower[axis][lane]);
      const Real upper = Magnitudes<Real>::magnitude(boxes.upper[axis][lane]);
      is_known = is_known && Magnitudes<Real>::isKnown(lower) && Magnitudes<Real>::isKnown(upper);
    }
    known |= static_cast<unsigned>(is_known) << lane;
    for (int axis = 0; axis < 3 && !is_known; ++axis)
      boxes.lower[axis][lane] = boxes.upper[axis][lane] = 0;
  }
  return known;
}

// How far computed depths may be off, for bounds of such magnitudes; NaN where a sum could
// overflow.
template <class Real>
inline double marginOf(const HalfSpace<Real>& plane, const Magnitudes<Real>& boxes) {
  double sum = __builtin_fabs(plane.distance);
  for (int axis = 0; axis < 3; ++axis)
    if (plane.normal[axis] != 0) sum += __builtin_fabs(plane.normal[axis]) * boxes.greatest[axis];
  // Near zero rounding has a least step, and what is on the plane is not clear of it.
  constexpr double least_margin = 4 * (sizeof(Real) > sizeof(float) ? __DBL_MIN__ : __FLT_MIN__);
  const double margin = plane.rounding * sum + least_margin;
  const bool safe = sum + margin < (sizeof(Real) > sizeof(float) ? __DBL_MAX__ : __FLT_MAX__) / 4;
  return safe ? margin : __builtin_nan("");
}

// How deep the deepest corners of sixteen boxes are in a half-space: the less, the deeper. They are
// at lower bounds where the normal points up.
template <class Real>
struct Depths {
  alignas(64) Real depth[group_size];

  Depths(const Group<Real>& boxes, const HalfSpace<Real>& plane) {
    const Real* corner[3];
    for (int axis = 0; axis < 3; ++axis)
      corner[axis] = plane.normal[axis] > 0 ? boxes.lower[axis] : boxes.upper[axis];
    for (int lane = 0; lane < group_size; ++lane)
      depth[lane] = plane.normal[0] * corner[0][lane] + plane.normal[1] * corner[1][lane] +
                    plane.normal[2] * corner[2][lane];
  }
  // Not where either is NaN.
  unsigned atLeast(double least) const { return Lanes::atLeast(depth, static_cast<Real>(least)); }
  unsigned atMost(double most) const { return Lanes::atMost(depth, static_cast<Real>(most)); }
};

// Boxes with bounds that are not known are never surely clear, nor do they surely reach a plane.
template <class Real>
std::size_t meetHalfSpaces(const BasicBox<Real>* boxes, std::size_t size, std::size_t begin,
                           std::size_t end, const HalfSpaces<Real>& planes, HalfSpaceHits* hits) {
  HalfSpaceHits* next = hits;
  for (std::size_t cell = begin; cell < end; ++cell) {
    const std::size_t first = cell * group_size, rest = size - first;
    Group<Real> group;
    packBoxes(group, boxes + first, rest < group_size ? rest : group_size);
    const unsigned active = Lanes::atMost(group.lower[0], static_cast<Real>(__builtin_inff()));
    unsigned known = ~0u;
    Magnitudes<Real> magnitudes(group);
    if (!magnitudes.areKnown()) {
      known = keepKnown(group);
      magnitudes = Magnitudes<Real>(group);
    }
    for (std::size_t plane = 0; plane < planes.count; ++plane) {
      const HalfSpace<Real>& half_space = planes.first[plane];
      const double distance = half_space.distance, margin = marginOf(half_space, magnitudes);
      const Depths<Real> depths(group, half_space);
      const unsigned maybe = active & ~(known & depths.atLeast(distance + margin));
      if (!maybe) continue;
      *next++ = {static_cast<std::uint32_t>(plane), static_cast<std::uint32_t>(cell),
                 static_cast<std::uint16_t>(maybe),
                 static_cast<std::uint16_t>(maybe & known & depths.atMost(distance - margin))};
    }
  }
  return next - hits;
}

}  // namespace
