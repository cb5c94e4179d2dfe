// The hits that a batch of rays owes, worked out with ODE's own rays and dCollide, one geom after
// the other.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <functional>
#include <string>
#include <vector>

#include "random.h"

namespace sap_test {

using Rays = std::vector<dParallelSAPRay>;
using RayHits = std::vector<dParallelSAPRayHit>;

// With all bits.
dParallelSAPRay rayOf(const double (&from)[3], const double (&along)[3], double length);

// Rays from around the geoms, most of them at one of them, at its middle, its rim or its corners,
// near it or from far away.
Rays raysAt(const std::vector<dGeomID>& geoms, std::size_t n, Random& random);

// A filter of queries as the oracle knows it; null: none.
using Filter = std::function<bool(std::size_t query, dGeomID geom)>;

// Of geoms in the order in which they were last added, sub-spaces gone through in their place: all
// hits of each ray, or the nearest of each geom, the nearest first. Asks for bounds, so the space
// goes first.
std::vector<RayHits> expectedHits(const std::vector<dGeomID>& in_add_order, const Rays& rays,
                                  int flags, bool nearest = false, const Filter& filter = nullptr);

bool sameBits(const dParallelSAPRayHit& a, const dParallelSAPRayHit& b);

// What the space answers.
RayHits nearestHits(dSpaceID space, const Rays& rays, int flags);
std::vector<RayHits> allHits(dSpaceID space, const Rays& rays, int flags);

// What both calls owe.
struct OwedRays {
  std::vector<RayHits> nearest, all;
};
OwedRays owedRays(const std::vector<dGeomID>& in_add_order, const Rays& rays, int flags,
                  const Filter& filter = nullptr);

// Both calls, bit for bit: "" or where they differ from what is owed.
std::string wrongRays(dSpaceID space, const Rays& rays, int flags, const OwedRays& owed);
std::string wrongRays(dSpaceID space, const std::vector<dGeomID>& in_add_order, const Rays& rays,
                      int flags);

}  // namespace sap_test
