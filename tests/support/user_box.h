// Geoms of a user class that have exactly the bounding box a test asks for.
#pragma once

#include <ode/ode.h>

#include "bounds.h"

namespace sap_test {

// The AABBTest of a geom: may `self` touch the box `bounds` of `other`?
using Veto = int (*)(dGeomID self, dGeomID other, dReal bounds[6]);

struct UserBoxData {
  Bounds bounds;
  bool relative;  // the bounds move with the geom's position
  Veto veto;      // 0: never objects
  unsigned mood;  // for vetoes to look at
};

// In space 0 the geom belongs to no space. Absolute bounds unless `relative`.
dGeomID createUserBox(dSpaceID space, const Bounds& bounds, bool relative = false, Veto veto = 0);
// Of another user class, which has no aabb_test at all.
dGeomID createUserBoxWithoutTest(dSpaceID space, const Bounds& bounds);

// Also marks the geom as moved.
void setUserBounds(dGeomID user_box, const Bounds& bounds);

bool isUserBox(dGeomID geom);
UserBoxData& userBoxData(dGeomID user_box);

// How often ODE or a space asked any user box for its bounding box since the program began.
unsigned long userBoundsAsked();
// Called whenever that happens; null: nothing is.
void setUserBoundsObserver(void (*observer)());

}  // namespace sap_test
