// Boxes against half-spaces. Internal linkage, as in kernels_impl.h.
#ifndef ODE_PARALLEL_SAP_SIMD_KERNEL_HALF_SPACES_H
#define ODE_PARALLEL_SAP_SIMD_KERNEL_HALF_SPACES_H

#include "kernel_rows.h"

namespace {

// Sixteen boxes and, on each axis, the greatest size of their bounds.
template <class Real>
struct SizedGroup {
  Group<Real> boxes;
  double size[3];

  SizedGroup(const BasicBox<Real>* first, std::size_t count) {
    const Real nan = static_cast<Real>(__builtin_nanf(""));
    for (int axis = 0; axis < 3; ++axis) {
      Real *const lower = boxes.lower[axis], *const upper = boxes.upper[axis];
      for (std::size_t lane = 0; lane < group_size; ++lane) {
        lower[lane] = lane < count ? first[lane].lower[axis] : nan;
        upper[lane] = lane < count ? first[lane].upper[axis] : nan;
      }
      size[axis] = 0;
      for (const Real bound : {Lanes::least(lower), Lanes::greatest(lower), Lanes::least(upper),
                               Lanes::greatest(upper)})
        if (__builtin_fabs(bound) > size[axis]) size[axis] = __builtin_fabs(bound);
    }
  }
};

// Which of the boxes may reach a half-space, and which of them surely do. The corner deepest in it
// is at lower bounds where the normal points up. All stay undecided where a sum could overflow, and
// boxes whose depth is NaN.
template <class Real>
inline HalfSpaceHits meetHalfSpace(const SizedGroup<Real>& group, const HalfSpace<Real>& plane) {
  double size = __builtin_fabs(plane.distance);
  const Real* corner[3];
  for (int axis = 0; axis < 3; ++axis) {
    corner[axis] = plane.normal[axis] > 0 ? group.boxes.lower[axis] : group.boxes.upper[axis];
    if (plane.normal[axis] != 0) size += __builtin_fabs(plane.normal[axis]) * group.size[axis];
  }
  alignas(64) Real depth[group_size];
  for (int lane = 0; lane < group_size; ++lane)
    depth[lane] = plane.normal[0] * corner[0][lane] + plane.normal[1] * corner[1][lane] +
                  plane.normal[2] * corner[2][lane];
  HalfSpaceHits hits = {0, 0, all_lanes, 0};
  // Near zero rounding has a least step, and what is on the plane is not clear of it.
  constexpr double least_margin = 4 * (sizeof(Real) > sizeof(float) ? __DBL_MIN__ : __FLT_MIN__);
  const double margin = plane.rounding * size + least_margin;
  if (!(size + margin < (sizeof(Real) > sizeof(float) ? __DBL_MAX__ : __FLT_MAX__) / 4))
    return hits;
  hits.maybe &= ~Lanes::atLeast(depth, static_cast<Real>(plane.distance + margin));
  hits.sure = hits.maybe & Lanes::atMost(depth, static_cast<Real>(plane.distance - margin));
  return hits;
}

template <class Real>
std::size_t meetHalfSpaces(const BasicBox<Real>* boxes, std::size_t size, std::size_t begin,
                           std::size_t end, const HalfSpace<Real>* planes, std::size_t count,
                           HalfSpaceHits* hits) {
  HalfSpaceHits* next = hits;
  for (std::size_t cell = begin; cell < end; ++cell) {
    const std::size_t first = cell * group_size;
    const SizedGroup<Real> group(boxes + first,
                                 size - first < group_size ? size - first : group_size);
    const unsigned active =
        Lanes::atMost(group.boxes.lower[0], static_cast<Real>(__builtin_inff()));
    for (std::size_t plane = 0; plane < count; ++plane) {
      HalfSpaceHits found = meetHalfSpace(group, planes[plane]);
      found.maybe &= active;
      if (!found.maybe) continue;
      found.sure &= active;
      found.plane = static_cast<std::uint32_t>(plane);
      found.cell = static_cast<std::uint32_t>(cell);
      *next++ = found;
    }
  }
  return next - hits;
}

}  // namespace

#endif
