// Hits of a batch of rays, and their order.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>

#include "space/data/box_set.h"

namespace ode_parallel_sap {

// Where a geom stands: its slot, or that of the sub-space that it is in, and its place within.
struct RayTarget {
  Slot slot;
  std::uint32_t within;
};

struct RayFound {
  std::size_t ray;
  RayTarget target;
  std::uint32_t contact;  // of those that dCollide found
  dParallelSAPRayHit hit;
};

// The distance of hits decides, then where the geoms stand. NaN is farther than all else.
inline bool isNearer(const RayFound& a, const RayFound& b) {
  const dReal p = a.hit.distance, q = b.hit.distance;
  if (p < q || q < p) return p < q;
  if ((p != p) != (q != q)) return q != q;
  if (a.target.slot != b.target.slot) return a.target.slot < b.target.slot;
  if (a.target.within != b.target.within) return a.target.within < b.target.within;
  return a.contact < b.contact;
}

inline bool isBefore(const RayFound& a, const RayFound& b) {
  return a.ray != b.ray ? a.ray < b.ray : isNearer(a, b);
}

inline dParallelSAPRayHit hitOf(dGeomID geom, const dContactGeom& contact) {
  dParallelSAPRayHit hit = {};
  hit.geom = geom;
  hit.distance = contact.depth;
  for (int axis = 0; axis < 3; ++axis) {
    hit.pos[axis] = contact.pos[axis];
    hit.normal[axis] = contact.normal[axis];
  }
  hit.side = contact.side2;
  return hit;
}

}  // namespace ode_parallel_sap
