// Exact bounds to floats.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "space/base/box_set.h"

namespace ode_parallel_sap {

// Bounds beyond the floats become the last finite ones, so that a difference of two is a number.
constexpr float most_bound = std::numeric_limits<float>::max();

// A box is coarse if a step of floats at its farthest bound is more than 1/32 of its largest
// extent: far from the origin for its size. fixed: also one near the denormals, with which not
// every device computes.
constexpr float coarse_share = 0x1p-19f, least_fine_extent = 3e-36f;

// What is to be known of bounds, in bits.
using BoundsFacts = unsigned;
enum : BoundsFacts {
  inexact_bounds = 1,    // the floats may not decide every overlap as the bounds would
  nan_bounds = 2,        // at least one is NaN; the box is of no use then
  unbounded_bounds = 4,  // an infinite bound, or a lower one above its upper one
  coarse_bounds = 8
};

// Rounds bounds (lower, upper on each axis) to the nearest floats. A lower bound above another
// never becomes the smaller one: of two boxes only equal bounds leave open if they overlap. Needs
// rounding to nearest and denormals kept.
template <class Real>
inline BoundsFacts roundToFloatsOneByOne(const Real* bounds, Box& box) {
  BoundsFacts facts = 0;
  const auto note = [&facts](bool is_so, BoundsFacts fact) { facts |= is_so ? fact : 0; };
  float extent = 0, farthest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    float rounded[2];
    for (int side = 0; side < 2; ++side) {
      const Real bound = bounds[2 * axis + side];
      const float value = static_cast<float>(bound), magnitude = std::fabs(value);
      const bool infinite = std::fabs(bound) > std::numeric_limits<Real>::max();
      rounded[side] = std::max(std::min(value, most_bound), -most_bound);
      // The last floats stand for infinity and for what is less.
      note(!infinite && (static_cast<Real>(value) != bound || magnitude == most_bound),
           inexact_bounds);
      note(bound != bound, nan_bounds);
      note(infinite, unbounded_bounds);
      farthest = std::max(farthest, std::min(magnitude, most_bound));
    }
    note(bounds[2 * axis] > bounds[2 * axis + 1], unbounded_bounds);
    extent = std::max(extent, rounded[1] - rounded[0]);
    box.lower[axis] = rounded[0];
    box.upper[axis] = rounded[1];
  }
  const bool far = std::max(farthest * coarse_share, least_fine_extent) > extent;
  note(far && facts & inexact_bounds, coarse_bounds);
  return facts;
}

template <class Real>
inline BoundsFacts roundToFloats(const Real* bounds, Box& box) {
  return roundToFloatsOneByOne(bounds, box);
}

// The same for a box like most: bounded, on no axis coarse, and with no bound from
// `most_step` / coarse_share on. False for others; anything may be in `box` then. `exact` becomes
// false if the floats may not decide every overlap as the bounds would.
template <class Real>
inline bool roundFine(const Real* bounds, float most_step, Box& box, bool& exact) {
  const BoundsFacts facts = roundToFloats(bounds, box);
  bool fine = !(facts & ~inexact_bounds);
  for (int axis = 0; axis < 3; ++axis)
    fine = fine && std::max(std::fabs(box.lower[axis]), std::fabs(box.upper[axis])) * coarse_share <
                       most_step;
  exact = exact && !(fine && facts);
  return fine;
}

#if defined(__SSE2__)
// Bounds as floats, an axis in a lane, the last one twice.
struct RoundedBounds {
  __m128 x, y, z, xy;  // lower and upper; lower x and y, upper x and y
  __m128 lower, upper, size;
  __m128 farthest;  // the greater magnitude, if the size is at least 0

  explicit RoundedBounds(const double* bounds)
      : x(_mm_cvtpd_ps(_mm_loadu_pd(bounds))),
        y(_mm_cvtpd_ps(_mm_loadu_pd(bounds + 2))),
        z(_mm_cvtpd_ps(_mm_loadu_pd(bounds + 4))),
        xy(_mm_unpacklo_ps(x, y)),
        lower(_mm_shuffle_ps(xy, z, _MM_SHUFFLE(0, 0, 1, 0))),
        upper(_mm_shuffle_ps(xy, z, _MM_SHUFFLE(1, 1, 3, 2))),
        size(_mm_sub_ps(upper, lower)),
        farthest(_mm_max_ps(_mm_sub_ps(_mm_setzero_ps(), lower), upper)) {}

  static bool areAllBelow(__m128 a, __m128 b) {
    return __builtin_expect(_mm_movemask_ps(_mm_cmplt_ps(a, b)) == 15, true);
  }
  // Of two numbers the second one counts where one is NaN, and NaN is below nothing.
  bool isFine(float most_step) const {
    const __m128 steps = _mm_mul_ps(farthest, _mm_set1_ps(coarse_share));
    return areAllBelow(_mm_max_ps(_mm_set1_ps(least_fine_extent), steps),
                       _mm_min_ps(_mm_set1_ps(most_step), size));
  }
  bool isBounded() const {
    return areAllBelow(_mm_setzero_ps(), size) &&
           areAllBelow(_mm_max_ps(farthest, size), _mm_set1_ps(most_bound));
  }
  bool isCoarse() const {
    __m128 most = _mm_max_ps(_mm_unpacklo_ps(farthest, size), _mm_unpackhi_ps(farthest, size));
    most = _mm_max_ps(most, _mm_movehl_ps(most, most));  // farthest, size
    const __m128 step =
        _mm_max_ss(_mm_mul_ss(most, _mm_set_ss(coarse_share)), _mm_set_ss(least_fine_extent));
    return _mm_comigt_ss(step, _mm_shuffle_ps(most, most, 1)) != 0;
  }
  bool areExact(const double* bounds) const {
    const __m128d same_x = _mm_cmpeq_pd(_mm_cvtps_pd(x), _mm_loadu_pd(bounds));
    const __m128d same_y = _mm_cmpeq_pd(_mm_cvtps_pd(y), _mm_loadu_pd(bounds + 2));
    const __m128d same_z = _mm_cmpeq_pd(_mm_cvtps_pd(z), _mm_loadu_pd(bounds + 4));
    return _mm_movemask_pd(_mm_and_pd(_mm_and_pd(same_x, same_y), same_z)) == 3;
  }
  // Two stores that do not overlap: the box is often read again at once, and a processor makes that
  // wait where it would have to join stores.
  void store(Box& box) const {
    const __m128 middle = _mm_shuffle_ps(z, xy, _MM_SHUFFLE(2, 2, 0, 0));
    _mm_storeu_ps(box.lower, _mm_shuffle_ps(xy, middle, _MM_SHUFFLE(2, 0, 1, 0)));
    _mm_storel_pi(reinterpret_cast<__m64*>(box.upper + 1),
                  _mm_shuffle_ps(upper, upper, _MM_SHUFFLE(2, 2, 2, 1)));
  }
};

template <>
inline BoundsFacts roundToFloats<double>(const double* bounds, Box& box) {
  const RoundedBounds rounded(bounds);
  if (!rounded.isBounded()) return roundToFloatsOneByOne(bounds, box);
  rounded.store(box);
  if (rounded.areExact(bounds)) return 0;
  return rounded.isCoarse() ? inexact_bounds | coarse_bounds : inexact_bounds;
}

template <>
inline bool roundFine<double>(const double* bounds, float most_step, Box& box, bool& exact) {
  const RoundedBounds rounded(bounds);
  if (!rounded.isFine(most_step)) return false;
  rounded.store(box);
  if (exact) exact = rounded.areExact(bounds);
  return true;
}
#endif

}  // namespace ode_parallel_sap
