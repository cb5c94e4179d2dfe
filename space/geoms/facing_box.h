// Bounds of a geom, laid out for tests of few boxes with all others. Sees ODE's private headers.
#pragma once

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// Two boxes overlap on an axis if neither's lower bound is above the other's upper one. With the
// one as (lower, -upper) and the other as (upper, -lower) both are a comparison of two lanes, so a
// pair takes three of them and no branch, which a processor could not foretell. Negated bounds are
// exact. Needs exactMode(): flushed denormals would compare as equal.
class FacingBox {
 public:
  FacingBox() = default;
  explicit FacingBox(const dxGeom* geom);

  // One box, turned to face others.
  class Turned {
   public:
    explicit Turned(const FacingBox& box);
    bool overlaps(const FacingBox& box) const;

   private:
#if defined(__SSE2__) && defined(dDOUBLE)
    __m128d bounds_[3];
#else
    dReal bounds_[3][2];
#endif
  };

 private:
  alignas(2 * sizeof(dReal)) dReal bounds_[3][2];
};

#if defined(__SSE2__) && defined(dDOUBLE)
inline FacingBox::FacingBox(const dxGeom* geom) {
  for (int axis = 0; axis < 3; ++axis) {
    const __m128d bounds = _mm_loadu_pd(geom->aabb + 2 * axis);
    _mm_store_pd(bounds_[axis], _mm_xor_pd(_mm_shuffle_pd(bounds, bounds, 1), _mm_set_pd(-0.0, 0)));
  }
}
inline FacingBox::Turned::Turned(const FacingBox& box) {
  for (int axis = 0; axis < 3; ++axis) {
    const __m128d bounds = _mm_load_pd(box.bounds_[axis]);
    bounds_[axis] = _mm_xor_pd(_mm_shuffle_pd(bounds, bounds, 1), _mm_set1_pd(-0.0));
  }
}
inline bool FacingBox::Turned::overlaps(const FacingBox& box) const {
  const auto apartOnAxis = [&](int axis) {
    return _mm_cmpnle_pd(bounds_[axis], _mm_load_pd(box.bounds_[axis]));
  };
  return _mm_movemask_pd(_mm_or_pd(_mm_or_pd(apartOnAxis(0), apartOnAxis(1)), apartOnAxis(2))) == 0;
}
#else
inline FacingBox::FacingBox(const dxGeom* geom) {
  for (int axis = 0; axis < 3; ++axis) {
    bounds_[axis][0] = geom->aabb[2 * axis + 1];
    bounds_[axis][1] = -geom->aabb[2 * axis];
  }
}
inline FacingBox::Turned::Turned(const FacingBox& box) {
  for (int axis = 0; axis < 3; ++axis) {
    bounds_[axis][0] = -box.bounds_[axis][1];
    bounds_[axis][1] = -box.bounds_[axis][0];
  }
}
inline bool FacingBox::Turned::overlaps(const FacingBox& box) const {
  bool overlap = true;
  for (int axis = 0; axis < 3; ++axis)
    overlap = overlap & (bounds_[axis][0] <= box.bounds_[axis][0]) &
              (bounds_[axis][1] <= box.bounds_[axis][1]);
  return overlap;
}
#endif

}  // namespace ode_parallel_sap
