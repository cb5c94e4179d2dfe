// Rays against boxes. Internal linkage, as in kernels_impl.h.
#pragma once

#include "space/simd/kernels.h"

namespace {

using namespace ode_parallel_sap;

// Both bounds on each axis are moved apart by the margin, so that errors of rounding, which are
// far smaller, leave no box out.
template <class Real>
unsigned meetRay(const Group<Real>& boxes, const RayQuery<Real>& ray, Real limit, Real* entry) {
  using Lane = Register<Real>;
  using Vector = typename Lane::Type;
  for (int first = 0; first < group_size; first += Lane::lanes) {
    const auto at = [first](const Real* row) {
      return *reinterpret_cast<const Vector*>(row + first);
    };
    Vector lower[3], upper[3], reach{};
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = at(boxes.lower[axis]) - ray.origin[axis];
      upper[axis] = at(boxes.upper[axis]) - ray.origin[axis];
      reach = Lane::greatest(Lane::greatest(-lower[axis], upper[axis]), reach);
    }
    const Vector margin = reach * ray.rounding + ray.slack;
    Vector near{}, far = near + limit;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector a = (lower[axis] - margin) * ray.inverse[axis];
      const Vector b = (upper[axis] + margin) * ray.inverse[axis];
      near = Lane::greatest(Lane::least(a, b), near);
      far = Lane::least(Lane::greatest(b, a), far);
    }
    // An unused place is NaN on all axes.
    const Vector none = Vector{} + static_cast<Real>(__builtin_nanf(""));
    *reinterpret_cast<Vector*>(entry + first) =
        ((near <= far) & (lower[0] == lower[0])) ? near : none;
  }
  return Lanes::atMost(entry, static_cast<Real>(__builtin_inff()));
}

}  // namespace
