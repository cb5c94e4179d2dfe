#ifndef TRADEOFF_SCENES_H
#define TRADEOFF_SCENES_H

#include <string>

#include "harness.h"

namespace tradeoff {

// Bodies of 20 triangles each fall into a bowl.
Scene meshScene(int bodies);

// Vehicles of five bodies each drive over bumps for some seconds, brake and stand.
Scene vehicleScene(int bodies);

constexpr double pi = 3.14159265358979;
constexpr double density = 1000;  // kg/m^3: water, wood, plastics; stone has 2,500, steel 8,000

inline dReal real(double value) {
  return static_cast<dReal>(value);
}

// A body with this geom, not damped: damping would hide errors; and what sleeps is for the settings
// to say.
inline dBodyID addBody(dWorldID world, dGeomID geom, const dMass& mass, const Vector& place) {
  const dBodyID body = dBodyCreate(world);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, real(place[0]), real(place[1]), real(place[2]));
  dGeomSetBody(geom, body);
  dBodySetLinearDamping(body, 0);
  dBodySetAngularDamping(body, 0);
  return body;
}

inline dBodyID addBox(dWorldID world, dSpaceID space, const Vector& side, const Vector& place) {
  dMass mass;
  dMassSetBox(&mass, real(density), real(side[0]), real(side[1]), real(side[2]));
  return addBody(world, dCreateBox(space, real(side[0]), real(side[1]), real(side[2])), mass,
                 place);
}

}  // namespace tradeoff

#endif
