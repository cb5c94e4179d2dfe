// How far from a ray and a geom's AABB ODE's ray colliders may find a hit.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "space/geoms/geom_tests.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// ODE 0.16's colliders of a ray with a sphere, box, capsule or cylinder compute with dReal, and a
// hit that they report is one of a shape near by. Let e be dReal's epsilon, c the shape's centre
// and q the distance from the origin to the farthest corner of its AABB. Each is a few sums of
// three products (at most 64 roundings, in any mode):
//
// - Places along an axis of the shape, and where the ray meets a face or cap: off by some e q.
// - Where it meets a round side is the root of B B - C, or B B - 4 A C: sums of squares of up to q,
//   off by up to 64 e q q, so the radius is off by up to sqrt (64 e) q. This is the greatest error,
//   and the distance is off by no more than the way through a shape so much larger.
// - With a direction that is not of length 1, and a matrix that is not a rotation, by n and m in
//   their products, the same happens with n in the place of e, and places are off by 2 m q.
//
// Twice the sum of them all is below `ray_rounding` q where n and m are as below. What comes of
// coordinates themselves (the AABB's own rounding, that of differences to the origin) is a part of
// them, not of q: RayQuery's slack. So the ray meets, not beyond the distance that is reported, the
// AABB widened by ray_rounding q + slack on each side.
constexpr bool is_double = sizeof(dReal) > sizeof(float);
constexpr dReal ray_rounding = is_double ? dReal(0x1p-17) : dReal(0x1p-6);  // fixed: see above
constexpr dReal most_segment = ray_rounding * ray_rounding / 32;            // n
constexpr dReal most_shear = ray_rounding / 16;                             // m
constexpr dReal most_coordinate =
    is_double ? dReal(1e15) : dReal(1e8);  // fixed: squares of squares fit
// fixed: what squares that underflow are off by, with the sum of a few.
constexpr dReal least_slack = is_double ? dReal(1e-150) : dReal(1e-17);

// Whether the columns of a matrix are as those of a rotation.
inline bool isRotation(const dReal* rows) {
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) {
      const dReal product =
          rows[i] * rows[j] + rows[4 + i] * rows[4 + j] + rows[8 + i] * rows[8 + j];
      if (!(std::fabs(product - dReal(i == j)) <= most_shear)) return false;
    }
  return true;
}

// Whether a geom with an AABB that is up to date has a collider with rays for which the bounds
// hold, or is a space of such geoms. Changes with the AABB only. Needs exactMode().
inline bool hasBoundedHits(const dxGeom* geom) {
  for (int axis = 0; axis < 3; ++axis) {
    const dReal lower = geom->aabb[2 * axis], upper = geom->aabb[2 * axis + 1];
    if (!(lower <= upper && lower >= -most_coordinate && upper <= most_coordinate)) return false;
  }
  if (IS_SPACE(geom)) {
    const dxGeom* own = static_cast<const dxSpace*>(geom)->first;
    while (own && hasBoundedHits(own)) own = own->next;
    return !own;
  }
  if (!geom->final_posr || geom->gflags & GEOM_POSR_BAD) return false;
  switch (geom->type) {
    case dSphereClass:
      return true;
    case dBoxClass:
    case dCapsuleClass:
    case dCylinderClass:
      return isRotation(geom->final_posr->R);
    default:
      return false;
  }
}

// Whether the bounds hold for this direction and origin.
inline bool isUsualRay(const dReal* origin, const dReal* direction) {
  dReal square = 0;
  bool usual = true;
  for (int axis = 0; axis < 3; ++axis) {
    square += direction[axis] * direction[axis];
    usual = usual && std::fabs(origin[axis]) <= most_coordinate;
  }
  return usual && std::fabs(square - 1) <= most_segment;
}

// A ray for which isUsualRay() says yes. Needs exactMode().
template <class Real>
RayQuery<Real> rayQuery(const dReal* origin, const dReal* direction) {
  // fixed: so that a step sideways of so much in the distance is far below ray_rounding.
  constexpr Real least_direction = Real(0x1p-30);
  RayQuery<Real> query;
  Real greatest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Real along = static_cast<Real>(direction[axis]);
    query.origin[axis] = static_cast<Real>(origin[axis]);
    query.inverse[axis] = 1 / std::copysign(std::max(std::fabs(along), least_direction), along);
    greatest = std::max(greatest, std::fabs(query.origin[axis]));
  }
  query.rounding = static_cast<Real>(ray_rounding);
  constexpr Real least = std::numeric_limits<Real>::min();
  query.slack = greatest * (8 * std::numeric_limits<Real>::epsilon()) +
                std::max(static_cast<Real>(least_slack), 16 * least);
  return query;
}

// A limit for all whose distance is at most `distance`, however they were rounded.
template <class Real>
Real limitFor(dReal distance) {
  return static_cast<Real>(distance) * Real(1 + 0x1p-16);
}

}  // namespace ode_parallel_sap
