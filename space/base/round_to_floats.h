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

#if defined(__SSE2__)
// The same for most boxes, an axis in a vector.
template <>
inline BoundsFacts roundToFloats<double>(const double* bounds, Box& box) {
  const __m128d x = _mm_loadu_pd(bounds), y = _mm_loadu_pd(bounds + 2),
                z = _mm_loadu_pd(bounds + 4);
  const __m128 float_x = _mm_cvtpd_ps(x), float_y = _mm_cvtpd_ps(y), float_z = _mm_cvtpd_ps(z);
  const __m128 xy = _mm_unpacklo_ps(float_x, float_y);  // lower x and y, upper x and y
  // The last lanes have z twice.
  const __m128 lower = _mm_shuffle_ps(xy, float_z, _MM_SHUFFLE(0, 0, 1, 0));
  const __m128 upper = _mm_shuffle_ps(xy, float_z, _MM_SHUFFLE(1, 1, 3, 2));
  const __m128 size = _mm_sub_ps(upper, lower);
  const __m128 signs = _mm_set1_ps(-0.0f);
  const __m128 bound = _mm_max_ps(_mm_andnot_ps(signs, lower), _mm_andnot_ps(signs, upper));
  const __m128 plain = _mm_and_ps(_mm_cmplt_ps(_mm_setzero_ps(), size),
                                  _mm_cmplt_ps(_mm_max_ps(bound, size), _mm_set1_ps(most_bound)));
  if (__builtin_expect(_mm_movemask_ps(plain) != 15, false))
    return roundToFloatsOneByOne(bounds, box);

  // Two stores that do not overlap: the box is often read again at once, and a processor makes that
  // wait where it would have to join stores.
  const __m128 middle = _mm_shuffle_ps(float_z, xy, _MM_SHUFFLE(2, 2, 0, 0));
  _mm_storeu_ps(box.lower, _mm_shuffle_ps(xy, middle, _MM_SHUFFLE(2, 0, 1, 0)));
  _mm_storel_pi(reinterpret_cast<__m64*>(box.upper + 1),
                _mm_shuffle_ps(upper, upper, _MM_SHUFFLE(2, 2, 2, 1)));

  const __m128d same = _mm_and_pd(
      _mm_and_pd(_mm_cmpeq_pd(_mm_cvtps_pd(float_x), x), _mm_cmpeq_pd(_mm_cvtps_pd(float_y), y)),
      _mm_cmpeq_pd(_mm_cvtps_pd(float_z), z));
  __m128 most = _mm_max_ps(_mm_unpacklo_ps(bound, size), _mm_unpackhi_ps(bound, size));
  most = _mm_max_ps(most, _mm_movehl_ps(most, most));  // bound, size
  const __m128 step =
      _mm_max_ss(_mm_mul_ss(most, _mm_set_ss(coarse_share)), _mm_set_ss(least_fine_extent));
  const bool far = _mm_comigt_ss(step, _mm_shuffle_ps(most, most, 1)) != 0;
  if (_mm_movemask_pd(same) == 3) return 0;
  return far ? inexact_bounds | coarse_bounds : inexact_bounds;
}
#endif

}  // namespace ode_parallel_sap
