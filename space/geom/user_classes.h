// Which of the user's classes have an AABBTest. Sees ODE's private headers.
#pragma once

#include <atomic>
#include <cstring>

#include "space/geom/ode_private.h"
#include "space/geom/pack_rules.h"

namespace ode_parallel_sap {

// Where the program's ODE keeps what dCreateGeomClass was given: in a table that no function tells
// of (space/contacts/class_table.h finds it).
struct UserClasses {
  const dGeomClass* classes;  // dMaxUserClasses of them
  const void* functions;      // the table of virtual functions of all their geoms
};

// Null until they are found, and then the same to the end.
inline std::atomic<const UserClasses*> user_classes{nullptr};

inline const UserClasses* foundUserClasses() {
  return user_classes.load(std::memory_order_acquire);
}

// The classes that have an AABBTest just now: dCloseODE ends them all, and others come. All of them
// where nobody knows.
inline UserClassSet testedClasses() {
  static_assert(dMaxUserClasses <= 8 * sizeof(UserClassSet), "a bit each");
  const UserClasses* const known = foundUserClasses();
  if (!known) return all_user_classes;
  UserClassSet tested = 0;
  for (int i = 0; i < dMaxUserClasses; ++i)
    if (known->classes[i].aabb_test) tested |= UserClassSet{1} << i;
  return tested;
}

inline bool isUserClass(const dxGeom* geom) {
  return geom->type >= dFirstUserClass && geom->type <= dLastUserClass;
}

// Whether a geom's AABBTest may say no, so that it has to be called: not those of ODE's own
// classes, which say yes to everything, as do those of the user's classes that have none. A geom of
// another C++ class that calls itself one of the user's is called.
inline bool hasAABBTest(const dxGeom* geom, UserClassSet tested) {
  if (!isUserClass(geom)) return false;
  if (tested >> (geom->type - dFirstUserClass) & 1) return true;
  const void* functions;
  std::memcpy(&functions, static_cast<const void*>(geom), sizeof functions);
  return functions != foundUserClasses()->functions;
}

}  // namespace ode_parallel_sap
