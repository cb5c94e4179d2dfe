// How large a geom is, as it lies.
#pragma once

#include <ode/ode.h>

#include <array>

struct dxGeom;

namespace ode_parallel_sap {

// Along its own axes, since of a turned plate the AABB is no measure; of unknown shapes along the
// world's.
std::array<dReal, 3> geomSides(dxGeom* geom);
dReal smallestSide(dxGeom* geom);
// How far from its body's centre what turns with it is: of a ball its centre, of all others the
// farthest corner of the AABB.
dReal armOf(const dxGeom* geom);

}  // namespace ode_parallel_sap
