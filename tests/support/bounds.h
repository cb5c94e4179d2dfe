// Bounding boxes as ODE has them.
#pragma once

#include <ode/ode.h>

#include <array>

namespace sap_test {

using Bounds = std::array<dReal, 6>;  // min x, max x, min y, max y, min z, max z

template <class Number>
constexpr dReal real(Number value) {
  return static_cast<dReal>(value);
}

inline Bounds boundsOf(dGeomID geom) {
  Bounds bounds;
  dGeomGetAABB(geom, bounds.data());
  return bounds;
}

inline bool overlap(const Bounds& a, const Bounds& b) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (a[2 * axis] > b[2 * axis + 1] || a[2 * axis + 1] < b[2 * axis]) return false;
  return true;
}

}  // namespace sap_test
