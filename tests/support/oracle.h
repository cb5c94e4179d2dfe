// The pairs and the order that dSpaceCollide owes, worked out from ODE's public functions alone:
// nothing in here knows how the library finds them.
#pragma once

#include <ode/ode.h>

#include <vector>

#include "bounds.h"
#include "recorder.h"
#include "scenes.h"

namespace sap_test {

// Whether it is a geom, or a space with a geom in it, at any depth.
bool holdsGeom(dGeomID geom);

// Enabled, not zero-sized and not an empty sub-space.
bool isOn(dGeomID geom);

// What may stand in a pair at all: on, and without a NaN bound.
bool takesPart(dGeomID geom);

// Of all geoms those that take part, and their bounds.
std::vector<dGeomID> takingPart(const std::vector<dGeomID>& all, std::vector<Bounds>& bounds);

// Bits, bodies, closed intervals in dReal and both AABBTest calls; both geoms take part.
bool mayTouch(dGeomID first, dGeomID second);

// The same for boxes that are not asked whether they overlap.
bool mayTouchIfNear(dGeomID first, dGeomID second);

// All pairs of the geoms, which are given in the order in which they were last added to their
// space: ascending by (earlier, later), earlier first. Quadratic. Asks every geom for its AABB,
// so let the space collide first, or ask about a twin.
Pairs expectedPairs(const std::vector<dGeomID>& in_add_order);

// The same for bare boxes, numbered by their place: closed intervals only.
Pairs expectedPairs(const Boxes& boxes);

}  // namespace sap_test
