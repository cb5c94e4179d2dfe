// How large a geom is, as it lies. Sees ODE's private headers.
#pragma once

#include <algorithm>
#include <cmath>

#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// Along its own axes, since of a turned plate the AABB is no measure; of unknown shapes along the
// world's.
inline dReal smallestSide(dxGeom* geom) {
  dReal radius, length;
  dVector3 sides;
  switch (geom->type) {
    case dSphereClass:
      return 2 * dGeomSphereGetRadius(geom);
    case dBoxClass:
      dGeomBoxGetLengths(geom, sides);
      break;
    case dCapsuleClass:
      dGeomCapsuleGetParams(geom, &radius, &length);
      return std::min(2 * radius, length + 2 * radius);
    case dCylinderClass:
      dGeomCylinderGetParams(geom, &radius, &length);
      return std::min(2 * radius, length);
    default:
      for (int axis = 0; axis < 3; ++axis)
        sides[axis] = geom->aabb[2 * axis + 1] - geom->aabb[2 * axis];
  }
  return std::min(sides[0], std::min(sides[1], sides[2]));
}

// How far from its body's centre what turns with it is: of a ball its centre, of all others the
// farthest corner of the AABB.
inline dReal armOf(const dxGeom* geom) {
  const dReal* const centre = dBodyGetPosition(geom->body);
  const bool ball = geom->type == dSphereClass;
  dReal arm[3];
  for (int axis = 0; axis < 3; ++axis) {
    const dReal below = centre[axis] - geom->aabb[2 * axis];
    const dReal above = geom->aabb[2 * axis + 1] - centre[axis];
    arm[axis] = ball ? geom->final_posr->pos[axis] - centre[axis]
                     : std::max(std::fabs(below), std::fabs(above));
  }
  return std::sqrt(arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2]);
}

}  // namespace ode_parallel_sap
