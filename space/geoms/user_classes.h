// Which of the user's classes have an AABBTest. Sees ODE's private headers.
#pragma once

#include <atomic>

#include "space/geoms/ode_private.h"
#include "space/geoms/pack_rules.h"

namespace ode_parallel_sap {

// Those that the program has declared to have none (dParallelSAPClassHasNoAABBTest), a bit each:
// ODE has no function that says which classes have one.
inline std::atomic<UserClassSet> untested_classes{0};

// The classes whose AABBTest may rule a pair out.
inline UserClassSet testedClasses() {
  static_assert(dMaxUserClasses <= 8 * sizeof(UserClassSet), "a bit each");
  return ~untested_classes.load(std::memory_order_relaxed);
}

inline bool isUserClass(const dxGeom* geom) {
  return geom->type >= dFirstUserClass && geom->type <= dLastUserClass;
}

// Whether a geom's AABBTest has to be called. Those of ODE's own classes accept every pair.
inline bool hasAABBTest(const dxGeom* geom, UserClassSet tested) {
  return isUserClass(geom) && (tested >> (geom->type - dFirstUserClass) & 1);
}

}  // namespace ode_parallel_sap
