// Exact bounds to conservative float bounds.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "space/base/box_set.h"
#include "space/base/float_steps.h"

namespace ode_parallel_sap {

// A box is coarse if rounding to floats lets it grow by more than this part of its largest extent:
// far from the origin for its size, beyond the range of floats or below their smallest steps.
constexpr double coarse_growth = 1.0 / 32;
// fixed: also if that comes near the denormals, with which not every device computes.
constexpr double least_fine_growth = 1e-37;

struct BoundsFacts {
  bool exact;      // no bound had to be rounded
  bool nan;        // at least one bound is NaN; the box is of no use then
  bool unbounded;  // an infinite bound, or a lower one above its upper one
  bool coarse;     // rounding makes the box clearly larger
};

// Rounds bounds (lower, upper on each axis) outward: a float bound is the nearest float that is not
// inside the exact one. Which way a bound is rounded is a toss of a coin, so nothing here branches
// on it: lower bounds change their sign, then all are rounded up, by one step in the order of the
// floats wherever the nearest float is too small. Needs rounding to nearest and denormals kept.
template <class Real>
inline BoundsFacts roundOutwardOneByOne(const Real* bounds, Box& box) {
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
      value = unordered(ordered(value) + (back < up));
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

template <class Real>
inline BoundsFacts roundOutward(const Real* bounds, Box& box) {
  return roundOutwardOneByOne(bounds, box);
}

#if defined(__SSE2__)
// One step up, where a mask of doubles is set: of negative numbers the bits are those of a smaller
// one.
inline __m128 stepUp(__m128 values, __m128d low_steps, __m128d high_steps) {
  const __m128 steps = _mm_shuffle_ps(_mm_castpd_ps(low_steps), _mm_castpd_ps(high_steps), 0x88);
  const __m128i bits = _mm_castps_si128(values);
  const __m128i step = _mm_or_si128(_mm_srai_epi32(bits, 31), _mm_set1_epi32(1));
  return _mm_castsi128_ps(_mm_add_epi32(bits, _mm_and_si128(step, _mm_castps_si128(steps))));
}

// Whether rounding lets an extent grow by more than `limit`. `xy` and `zz`: the rounded bounds, the
// lower ones with their signs changed.
inline bool growsBeyond(double limit, __m128 xy, __m128 zz, __m128d size, __m128d size_z) {
  const __m128d back_z = _mm_cvtps_pd(zz);
  const __m128d growth =
      _mm_sub_pd(_mm_add_pd(_mm_cvtps_pd(xy), _mm_cvtps_pd(_mm_movehl_ps(xy, xy))), size);
  const __m128d growth_z =
      _mm_sub_pd(_mm_add_pd(back_z, _mm_shuffle_pd(back_z, back_z, 1)), size_z);
  return _mm_movemask_pd(_mm_cmpgt_pd(_mm_max_pd(growth, growth_z), _mm_set1_pd(limit))) != 0;
}

// Two stores that do not overlap: the box is often read again at once, and a processor makes that
// wait where it would have to join stores.
inline void storeBox(__m128 xy, __m128 zz, Box& box) {
  const __m128 signs = _mm_set_ps(0.0f, 0.0f, -0.0f, -0.0f);
  const __m128 xy_box = _mm_xor_ps(xy, signs), zz_box = _mm_xor_ps(zz, _mm_set_ss(-0.0f));
  const __m128 middle = _mm_shuffle_ps(zz_box, xy_box, _MM_SHUFFLE(2, 2, 0, 0));
  const __m128 uppers = _mm_shuffle_ps(xy_box, zz_box, _MM_SHUFFLE(1, 1, 3, 3));
  float bounds_of_box[6];
  _mm_storeu_ps(bounds_of_box, _mm_shuffle_ps(xy_box, middle, _MM_SHUFFLE(2, 0, 1, 0)));
  _mm_storel_pd(reinterpret_cast<double*>(bounds_of_box + 4),
                _mm_castps_pd(_mm_shuffle_ps(uppers, uppers, _MM_SHUFFLE(2, 0, 2, 0))));
  std::memcpy(static_cast<void*>(&box), bounds_of_box, sizeof box);
}

// The same for bounded boxes, in vectors of which one has an axis's two bounds and the others a
// bound of two axes each.
template <>
inline BoundsFacts roundOutward<double>(const double* bounds, Box& box) {
  const __m128d x = _mm_loadu_pd(bounds), y = _mm_loadu_pd(bounds + 2),
                z = _mm_loadu_pd(bounds + 4);
  const __m128d lower = _mm_unpacklo_pd(x, y), upper = _mm_unpackhi_pd(x, y);
  const __m128d size = _mm_sub_pd(upper, lower);
  const __m128d size_z = _mm_sub_pd(_mm_unpackhi_pd(z, z), _mm_unpacklo_pd(z, z));
  const __m128d infinity = _mm_set1_pd(std::numeric_limits<double>::infinity());
  const __m128d bounded = _mm_and_pd(_mm_cmple_pd(_mm_setzero_pd(), _mm_min_pd(size, size_z)),
                                     _mm_cmplt_pd(_mm_add_pd(size, size_z), infinity));
  if (__builtin_expect(_mm_movemask_pd(bounded) != 3, false))
    return roundOutwardOneByOne(bounds, box);

  const __m128d up[] = {_mm_xor_pd(lower, _mm_set1_pd(-0.0)), upper,
                        _mm_xor_pd(z, _mm_set_pd(0.0, -0.0))};
  __m128 rounded[3];
  __m128d too_small[3], inexact = _mm_setzero_pd();
  for (int i = 0; i < 3; ++i) {
    rounded[i] = _mm_cvtpd_ps(up[i]);
    const __m128d back = _mm_cvtps_pd(rounded[i]);
    too_small[i] = _mm_cmplt_pd(back, up[i]);
    inexact = _mm_or_pd(inexact, _mm_cmpneq_pd(back, up[i]));
  }
  const __m128 xy = stepUp(_mm_movelh_ps(rounded[0], rounded[1]), too_small[0], too_small[1]);
  const __m128 zz = stepUp(rounded[2], too_small[2], too_small[2]);

  const __m128d sizes = _mm_max_pd(size, size_z);
  const double limit =
      _mm_cvtsd_f64(_mm_max_sd(sizes, _mm_unpackhi_pd(sizes, sizes))) * coarse_growth;
  const bool exact = _mm_movemask_pd(inexact) == 0;
  const bool coarse =
      growsBeyond(limit, xy, zz, size, size_z) || (!exact && limit < least_fine_growth);
  storeBox(xy, zz, box);
  return {exact, false, false, coarse};
}
#endif

}  // namespace ode_parallel_sap
