// Whether a plane's half-space and a geom's AABB are clear of each other. Sees ODE's private
// headers.
#pragma once

#include <cmath>
#include <limits>

#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// A dPlane is solid where normal * x <= distance. The corner of the AABB that is deepest in it
// tells whether the AABB reaches it, but for errors of rounding: those of this sum (three products,
// three sums), of ODE's own when it computed the AABB from pose and size, and of ODE's collider
// when it decides what touches. Each is a few times epsilon times the largest numbers that take
// part, which are bounded by the AABB's own bounds and the distance. 32 times is more than all of
// them together.
constexpr double plane_rounding = 32 * static_cast<double>(std::numeric_limits<dReal>::epsilon());

// The greatest magnitude of the finite ones of two bounds. An infinite one is no result of
// rounding, and gives none to the other.
inline double finiteMagnitude(double lower, double upper) {
  constexpr double most = std::numeric_limits<dReal>::max();
  lower = std::fabs(lower);
  upper = std::fabs(upper);
  return std::fmax(lower <= most ? lower : 0, upper <= most ? upper : 0);
}

// True only if no point of the AABB, moved by such errors, is in the half-space. False where
// anything is NaN. A half-infinite AABB is clear of the plane if all of it is. Needs exactMode().
inline bool isClearOfPlane(const dReal* aabb, const dReal* plane) {
  double depth = -static_cast<double>(plane[3]), size = std::fabs(static_cast<double>(plane[3]));
  for (int axis = 0; axis < 3; ++axis) {
    const double normal = plane[axis], lower = aabb[2 * axis], upper = aabb[2 * axis + 1];
    if (normal == 0) continue;
    depth += normal * (normal > 0 ? lower : upper);
    size += std::fabs(normal) * finiteMagnitude(lower, upper);
  }
  return depth > plane_rounding * size + std::numeric_limits<double>::min();
}

// Whether one of the geoms is a plane of which the other one's AABB is clear.
__attribute__((noinline)) inline bool areClearByPlane(dxGeom* a, dxGeom* b) {
  if (a->type != dPlaneClass && b->type != dPlaneClass) return false;
  dVector4 plane;
  for (const bool swapped : {false, true}) {
    dxGeom *const first = swapped ? b : a, *const second = swapped ? a : b;
    if (first->type != dPlaneClass) continue;
    dGeomPlaneGetParams(first, plane);
    if (isClearOfPlane(second->aabb, plane)) return true;
  }
  return false;
}

}  // namespace ode_parallel_sap
