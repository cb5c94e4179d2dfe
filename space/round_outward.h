// Exact bounds to conservative float bounds.
#ifndef ODE_PARALLEL_SAP_ROUND_OUTWARD_H
#define ODE_PARALLEL_SAP_ROUND_OUTWARD_H

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "box_set.h"

namespace ode_parallel_sap {

struct BoundsFacts {
  bool exact;      // no bound had to be rounded
  bool nan;        // at least one bound is NaN; the box is of no use then
  bool unbounded;  // an infinite bound, or a lower one above its upper one
  bool coarse;     // rounding makes the box clearly larger
};

// A box is coarse if rounding lets it grow by more than this part of its largest extent: far from
// the origin for its size, beyond the range of floats or below their smallest steps.
constexpr double coarse_growth = 1.0 / 32;
// So is a box whose extent comes near the denormals, with which not every device computes.
constexpr double least_fine_growth = 1e-37;

// Rounds bounds (lower, upper on each axis) outward: a float bound is the nearest float that is not
// inside the exact one. Which way a bound is rounded is a toss of a coin, so nothing here branches
// on it: lower bounds change their sign, then all are rounded up, by one step in the order of the
// floats wherever the nearest float is too small. Needs rounding to nearest and denormals kept.
template <class Real>
inline BoundsFacts roundOutward(const Real* bounds, Box& box) {
  constexpr Real most = std::numeric_limits<Real>::max();
  bool exact = true, nan = false, unbounded = false;
  Real extent = 0, growth[3];
  for (int axis = 0; axis < 3; ++axis) {
    unbounded |= bounds[2 * axis] > bounds[2 * axis + 1];
    extent = std::max(extent, bounds[2 * axis + 1] - bounds[2 * axis]);
    for (int side = 0; side < 2; ++side) {
      const Real bound = bounds[2 * axis + side], up = side ? bound : -bound;
      float value = static_cast<float>(up);
      const Real back = static_cast<Real>(value);
      exact &= back == up;
      nan |= up != up;
      unbounded |= std::fabs(up) > most;
      std::int32_t bits;
      std::memcpy(&bits, &value, sizeof bits);
      bits ^= (bits >> 31) & 0x7fffffff;  // order of the integers = order of the floats
      bits += back < up;
      bits ^= (bits >> 31) & 0x7fffffff;
      std::memcpy(&value, &bits, sizeof bits);
      (side ? box.upper : box.lower)[axis] = side ? value : -value;
    }
    growth[axis] = (static_cast<Real>(box.upper[axis]) - static_cast<Real>(box.lower[axis])) -
                   (bounds[2 * axis + 1] - bounds[2 * axis]);
  }
  // False where a bound is infinite, and the growth with it NaN.
  const Real limit = extent * static_cast<Real>(coarse_growth);
  bool coarse = !exact && limit < static_cast<Real>(least_fine_growth);
  for (int axis = 0; axis < 3; ++axis) coarse |= growth[axis] > limit;
  return {exact, nan, unbounded, coarse};
}

#if defined(__SSE2__)
// The same, an axis at a time.
template <>
inline BoundsFacts roundOutward<double>(const double* bounds, Box& box) {
  const __m128d flip_lower = _mm_set_pd(0.0, -0.0), sign = _mm_set1_pd(-0.0);
  const __m128d most = _mm_set1_pd(std::numeric_limits<double>::max());
  __m128d inexact = _mm_setzero_pd(), nan = inexact, unbounded = inexact;
  __m128d extents[3];  // in the low half
  __m128 value[3], too_small[3];
  for (int axis = 0; axis < 3; ++axis) {
    const __m128d bound = _mm_loadu_pd(bounds + 2 * axis), up = _mm_xor_pd(bound, flip_lower);
    value[axis] = _mm_cvtpd_ps(up);
    const __m128d back = _mm_cvtps_pd(value[axis]), small = _mm_cmplt_pd(back, up);
    too_small[axis] = _mm_shuffle_ps(_mm_castpd_ps(small), _mm_castpd_ps(small), 0x88);
    inexact = _mm_or_pd(inexact, _mm_cmpneq_pd(back, up));
    nan = _mm_or_pd(nan, _mm_cmpunord_pd(up, up));
    unbounded = _mm_or_pd(unbounded, _mm_cmpgt_pd(_mm_andnot_pd(sign, up), most));
    extents[axis] = _mm_sub_sd(_mm_shuffle_pd(bound, bound, 1), bound);
    // In the low half only: lower above upper.
    unbounded = _mm_or_pd(
        unbounded,
        _mm_move_sd(_mm_setzero_pd(), _mm_cmpgt_pd(bound, _mm_shuffle_pd(bound, bound, 1))));
  }
  const auto stepped = [](__m128 values, __m128 steps) {
    const __m128i magnitude = _mm_set1_epi32(0x7fffffff);
    __m128i bits = _mm_castps_si128(values);
    bits = _mm_xor_si128(bits, _mm_and_si128(_mm_srai_epi32(bits, 31), magnitude));
    bits = _mm_sub_epi32(bits, _mm_castps_si128(steps));
    bits = _mm_xor_si128(bits, _mm_and_si128(_mm_srai_epi32(bits, 31), magnitude));
    return _mm_xor_ps(_mm_castsi128_ps(bits), _mm_set_ps(0.0f, -0.0f, 0.0f, -0.0f));
  };
  const __m128 xy =
      stepped(_mm_movelh_ps(value[0], value[1]), _mm_movelh_ps(too_small[0], too_small[1]));
  const __m128 z = stepped(value[2], too_small[2]);
  // Two stores that do not overlap: the box is often read again at once, and a processor makes that
  // wait where it would have to join stores.
  const __m128 middle = _mm_shuffle_ps(z, xy, _MM_SHUFFLE(1, 1, 0, 0));
  const __m128 uppers = _mm_shuffle_ps(xy, z, _MM_SHUFFLE(1, 1, 3, 3));
  float bounds_of_box[6];
  _mm_storeu_ps(bounds_of_box, _mm_shuffle_ps(xy, middle, _MM_SHUFFLE(2, 0, 2, 0)));
  _mm_storel_pd(reinterpret_cast<double*>(bounds_of_box + 4),
                _mm_castps_pd(_mm_shuffle_ps(uppers, uppers, _MM_SHUFFLE(2, 0, 2, 0))));
  std::memcpy(static_cast<void*>(&box), bounds_of_box, sizeof box);
  const bool exact = _mm_movemask_pd(inexact) == 0;
  // The largest extent, and the growth on each axis: NaN, and so not coarse, where a bound is
  // infinite.
  const double limit =
      coarse_growth * _mm_cvtsd_f64(_mm_max_sd(extents[0], _mm_max_sd(extents[1], extents[2])));
  bool coarse = !exact && limit < least_fine_growth;
  for (int axis = 0; axis < 3; ++axis)
    coarse |= (static_cast<double>(box.upper[axis]) - static_cast<double>(box.lower[axis])) -
                  _mm_cvtsd_f64(extents[axis]) >
              limit;
  return {exact, _mm_movemask_pd(nan) != 0, _mm_movemask_pd(unbounded) != 0, coarse};
}
#endif

}  // namespace ode_parallel_sap

#endif
