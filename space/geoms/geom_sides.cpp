#include "space/geoms/geom_sides.h"

#include <algorithm>
#include <cmath>

#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

dReal armOf(const dxGeom* geom) {
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

std::array<dReal, 3> geomSides(dxGeom* geom) {
  dReal radius = 0, length = 0;
  dVector3 sides;
  const dReal* const box = geom->aabb;
  switch (geom->type) {
    case dSphereClass:
      radius = dGeomSphereGetRadius(geom);
      break;
    case dBoxClass:
      dGeomBoxGetLengths(geom, sides);
      return {sides[0], sides[1], sides[2]};
    case dCapsuleClass:
      dGeomCapsuleGetParams(geom, &radius, &length);
      break;
    case dCylinderClass:
      dGeomCylinderGetParams(geom, &radius, &length);
      return {2 * radius, 2 * radius, length};
    default:
      return {box[1] - box[0], box[3] - box[2], box[5] - box[4]};
  }
  return {2 * radius, 2 * radius, length + 2 * radius};
}

dReal smallestSide(dxGeom* geom) {
  const std::array<dReal, 3> sides = geomSides(geom);
  return std::min(sides[0], std::min(sides[1], sides[2]));
}

}  // namespace ode_parallel_sap
