// AABBs of ODE's simple classes, without a virtual call for each. Sees ODE's private headers.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

// The bounds on an axis. Whoever tests the boxes of few geoms loads both at once a moment later,
// and would wait for two stores to reach the cache: one of both is handed on.
template <class Real>
inline void putBounds(Real lower, Real upper, Real* bounds) {
  bounds[0] = lower;
  bounds[1] = upper;
}

#if defined(__SSE2__)
template <>
inline void putBounds<double>(double lower, double upper, double* bounds) {
  _mm_storeu_pd(bounds, _mm_set_pd(upper, lower));
}
#endif

// The AABB reaches this far from the geom's place, on each axis.
template <class Real>
inline void putAround(const Real* place, const Real* reach, Real* aabb) {
  for (int axis = 0; axis < 3; ++axis)
    putBounds(place[axis] - reach[axis], place[axis] + reach[axis], aabb + 2 * axis);
}

// One for each class: the operations of ODE's computeAABB() in their order, on the same numbers,
// whatever these are.
inline void computeBounds(dxSphere& sphere) {
  const dReal reach[3] = {sphere.radius, sphere.radius, sphere.radius};
  putAround(sphere.final_posr->pos, reach, sphere.aabb);
}

// Half of the extent along an axis, by a row of the rotation.
template <class Real>
inline Real halfExtent(const Real* row, const Real* side) {
  return Real(0.5) *
         (std::fabs(row[0] * side[0]) + std::fabs(row[1] * side[1]) + std::fabs(row[2] * side[2]));
}

template <class Real>
inline void boundsOfBox(const Real* place, const Real* rows, const Real* side, Real* aabb) {
  const Real reach[3] = {halfExtent(rows, side), halfExtent(rows + 4, side),
                         halfExtent(rows + 8, side)};
  putAround(place, reach, aabb);
}

#if defined(__SSE2__)
// X and y in one vector. A place may have been written a moment ago, number by number: it is loaded
// likewise, as one load would wait for both stores to reach the cache. A compiler is not to join
// the two.
template <>
inline void boundsOfBox<double>(const double* place, const double* rows, const double* side,
                                double* aabb) {
  const auto product = [&](int column) {
    const __m128d of_both = _mm_loadh_pd(_mm_load_sd(rows + column), rows + 4 + column);
    return _mm_andnot_pd(_mm_set1_pd(-0.0), _mm_mul_pd(of_both, _mm_set1_pd(side[column])));
  };
  const __m128d sum = _mm_add_pd(_mm_add_pd(product(0), product(1)), product(2));
  const __m128d reach = _mm_mul_pd(_mm_set1_pd(0.5), sum);
  __m128d at = _mm_load_sd(place);
  __asm__("" : "+x"(at));
  at = _mm_loadh_pd(at, place + 1);
  const __m128d lower = _mm_sub_pd(at, reach), upper = _mm_add_pd(at, reach);
  const double reach_z = halfExtent(rows + 8, side);
  _mm_storeu_pd(aabb, _mm_unpacklo_pd(lower, upper));
  _mm_storeu_pd(aabb + 2, _mm_unpackhi_pd(lower, upper));
  putBounds(place[2] - reach_z, place[2] + reach_z, aabb + 4);
}
#endif

inline void computeBounds(dxBox& box) {
  boundsOfBox<dReal>(box.final_posr->pos, box.final_posr->R, box.side, box.aabb);
}

inline void computeBounds(dxCapsule& capsule) {
  const dReal* const rows = capsule.final_posr->R;
  dReal reach[3];
  for (int axis = 0; axis < 3; ++axis)
    reach[axis] = std::fabs(rows[4 * axis + 2] * capsule.lz) * dReal(0.5) + capsule.radius;
  putAround(capsule.final_posr->pos, reach, capsule.aabb);
}

inline void computeBounds(dxCylinder& cylinder) {
  const dReal* const rows = cylinder.final_posr->R;
  dReal reach[3];
  for (int axis = 0; axis < 3; ++axis) {
    const dReal along = rows[4 * axis + 2], across = dReal(1) - along * along;
    reach[axis] = std::fabs(along * cylinder.lz * dReal(0.5)) +
                  cylinder.radius * std::sqrt(dReal(0) > across ? dReal(0) : across);
  }
  putAround(cylinder.final_posr->pos, reach, cylinder.aabb);
}

// How an ODE was compiled decides on the last bits of its AABBs. So each class is compared with
// that of the ODE which is loaded, on some hundred poses and sizes; a class whose bounds are not
// the same, bit for bit, is left to ODE. So are classes of others that call themselves the same:
// what tells a geom's class is its table of virtual functions.
class StockBounds {
 public:
  // Those of the ODE that is loaded, from the first call on: that makes a geom of each class.
  static const StockBounds& ofLoadedOde() {
    static const StockBounds loaded = compareAll();
    return loaded;
  }

  // Whether the AABB of a geom can be computed here.
  bool knows(const dxGeom* geom) const {
    return static_cast<unsigned>(geom->type) < static_cast<unsigned>(classes) &&
           tableOf(geom) == tables_[geom->type];
  }
  // What geom->computeAABB() does, for a geom that is known.
  static void compute(dxGeom* geom) {
    if (geom->type == dBoxClass) return computeBounds(*static_cast<dxBox*>(geom));  // most often
    switch (geom->type) {
      case dSphereClass:
        return computeBounds(*static_cast<dxSphere*>(geom));
      case dCapsuleClass:
        return computeBounds(*static_cast<dxCapsule*>(geom));
      default:
        return computeBounds(*static_cast<dxCylinder*>(geom));
    }
  }
  // What dxGeom::recomputeAABB() does, for a geom that is known, which is clean then.
  static void clean(dxGeom* geom) {
    if (geom->gflags & GEOM_AABB_BAD) {
      geom->recomputePosr();
      compute(geom);
    }
    geom->gflags &= ~(GEOM_DIRTY | GEOM_AABB_BAD);
  }

  // Takes a class for known if a geom of it agrees on `poses` poses.
  void learn(dxGeom* geom, std::size_t poses);
  // Whether a geom's own computeAABB() writes the bounds that compute() does, on so many random
  // poses and sizes: usual ones, and numbers of any bits. Any NaN is as good as another. The geom
  // keeps the last ones.
  static bool agree(dxGeom* geom, std::size_t poses, std::uint64_t seed);

 private:
  static constexpr int classes = dCylinderClass + 1;

  static StockBounds compareAll();
  static const void* tableOf(const dxGeom* geom) {
    const void* table;
    std::memcpy(&table, static_cast<const void*>(geom), sizeof table);
    return table;
  }

  const void* tables_[classes] = {};  // by class; null: left to ODE
};

}  // namespace ode_parallel_sap
