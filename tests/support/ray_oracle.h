// The hits that a batch of rays owes, worked out with ODE's own rays and dCollide, one geom after
// the other.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <functional>
#include <string>
#include <vector>

#include "bounds.h"
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

bool sameBits(const dParallelSAPRayHit& a, const dParallelSAPRayHit& b);

RayHits nearestHits(dSpaceID space, const Rays& rays, int flags);
std::vector<RayHits> allHits(dSpaceID space, const Rays& rays, int flags);

// What both calls answer, or owe.
struct RayAnswers {
  RayHits nearest;
  std::vector<RayHits> all;
};
RayAnswers answersOf(dSpaceID space, const Rays& rays, int flags);
// Of geoms in the order in which they were last added, sub-spaces gone through in their place.
// Asks for bounds, so the space goes first.
RayAnswers owedRays(const std::vector<dGeomID>& in_add_order, const Rays& rays, int flags,
                    const Filter& filter = nullptr);

// Bit for bit: "" or where they differ.
std::string difference(const RayAnswers& got, const RayAnswers& owed);
std::string wrongRays(dSpaceID space, const std::vector<dGeomID>& in_add_order, const Rays& rays,
                      int flags);

// One of the two kinds of query, for tests of both: ProbeBatch is the other.
struct RayBatch {
  Rays rays;
  std::size_t n;
  Random& random;

  RayBatch(std::size_t count, Random& of) : n(count), random(of) {}
  void moveTo(const std::vector<dGeomID>& geoms) { rays = raysAt(geoms, n, random); }
  int someFlags();
  RayAnswers ask(dSpaceID space, int flags) const { return answersOf(space, rays, flags); }
  RayAnswers owed(dSpaceID, const std::vector<dGeomID>& in_add_order, int flags,
                  const Filter& filter = nullptr) const {
    return owedRays(in_add_order, rays, flags, filter);
  }
  static std::size_t meeting(const RayAnswers& answers);  // how many of them
  // The call with a callback, which gets the first geom of each report.
  void report(dSpaceID space, int flags, const std::function<void(dGeomID)>& callback) const;
  // What the query's own box lies in.
  Bounds bounds(std::size_t query) const;
};

}  // namespace sap_test
