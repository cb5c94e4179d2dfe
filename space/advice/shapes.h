// What the warnings ask of geoms and bodies.
#pragma once

#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "space/geoms/geom_sides.h"

namespace ode_parallel_sap {

constexpr double infinity = std::numeric_limits<double>::infinity();

inline double number(dReal x) {
  return static_cast<double>(x);
}
inline double dot(const dReal* a, const dReal* b) {
  return number(a[0]) * number(b[0]) + number(a[1]) * number(b[1]) + number(a[2]) * number(b[2]);
}
inline double lengthOf(const dReal* v) {
  return std::sqrt(dot(v, v));
}
inline bool moves(dBodyID body) {
  return body && !dBodyIsKinematic(body);
}

// Along its own axes, or the world's; endless for what nothing gets through.
inline std::array<double, 3> ownSidesOf(dGeomID geom) {
  const int type = dGeomGetClass(geom);
  if (type == dPlaneClass || type == dHeightfieldClass || type == dRayClass)
    return {infinity, infinity, infinity};
  dReal box[6];
  dGeomGetAABB(geom, box);  // which that of a mesh is read from
  const std::array<dReal, 3> sides = geomSides(geom);
  return {number(sides[0]), number(sides[1]), number(sides[2])};
}

// The smallest one first.
inline std::array<double, 3> sidesOf(dGeomID geom) {
  std::array<double, 3> sides = ownSidesOf(geom);
  std::sort(sides.begin(), sides.end());
  return sides;
}

inline double reachOf(dGeomID geom, dBodyID body) {
  const dReal* const centre = dBodyGetPosition(body);
  dReal box[6];
  dGeomGetAABB(geom, box);
  dVector3 arm = {0, 0, 0, 0};
  for (int i = 0; i < 3; ++i) arm[i] = std::max(centre[i] - box[2 * i], box[2 * i + 1] - centre[i]);
  return lengthOf(arm);
}

// About its third axis.
inline bool isRound(int type) {
  return type == dCylinderClass || type == dCapsuleClass;
}

// The side of a geom along a direction.
inline double sideAlong(dGeomID geom, const dReal* direction) {
  const int type = dGeomGetClass(geom);
  const std::array<double, 3> sides = ownSidesOf(geom);
  const double length = lengthOf(direction);
  if (length == 0 || !(type == dBoxClass || isRound(type))) return sidesOf(geom)[0];
  const dReal* const turn = dGeomGetRotation(geom);
  std::array<double, 3> along;
  for (std::size_t i = 0; i < 3; ++i) {
    const dVector3 axis = {turn[i], turn[4 + i], turn[8 + i]};
    along[i] = std::min(1.0, std::fabs(dot(axis, direction)) / length);
  }
  if (isRound(type)) along = {std::sqrt(1 - along[2] * along[2]), 0, along[2]};
  return sides[0] * along[0] + sides[1] * along[1] + sides[2] * along[2];
}

// How fast a body turns about other axes than one about which its geom is round.
inline double sweepingTurn(dGeomID geom, dBodyID body) {
  const dReal *const rate = dBodyGetAngularVel(body), *const turn = dGeomGetRotation(geom);
  const int type = dGeomGetClass(geom);
  if (dGeomIsOffset(geom) || !(isRound(type) || type == dSphereClass)) return lengthOf(rate);
  dVector3 across = {0, 0, 0, 0};
  const dVector3 axis = {turn[2], turn[6], turn[10]};
  if (isRound(type)) dCalcVectorCross3(across, rate, axis);
  return lengthOf(across);
}

// Of two geoms, as far as they move.
inline double smallerSize(dGeomID a, dGeomID b) {
  return std::min(moves(dGeomGetBody(a)) ? sidesOf(a)[1] : infinity,
                  moves(dGeomGetBody(b)) ? sidesOf(b)[1] : infinity);
}

// Whose collider any thread may call, with no data of its own.
inline bool isSimple(dGeomID geom) {
  const int type = dGeomGetClass(geom);
  return type == dSphereClass || type == dBoxClass || type == dCapsuleClass ||
         type == dCylinderClass || type == dPlaneClass;
}

}  // namespace ode_parallel_sap
