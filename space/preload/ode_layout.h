// Whether the ODE in this process is laid out as the private headers say. The build asks about the
// ODE that it found (cmake/check_ode.cpp), the preload library about the one that a program brings.
// Sees ODE's private headers.
#pragma once

#include <cstring>

#include "space/geoms/slot_home.h"

namespace ode_parallel_sap {

// All of these return null, or the first expectation that does not hold: what the library writes
// through the public API is read back through the private layout.

#define EXPECT(condition) \
  if (!(condition)) return #condition

// A new sphere of radius 2.
inline const char* misfitOfSphere(dxGeom* geom) {
  EXPECT(geom->type == dSphereClass && static_cast<dxSphere*>(geom)->radius == 2);
  EXPECT(geom->gflags == (GEOM_DIRTY | GEOM_AABB_BAD | GEOM_ENABLED | GEOM_PLACEABLE));
  EXPECT(geom->data == nullptr && geom->body == nullptr && geom->offset_posr == nullptr);
  EXPECT(geom->next == nullptr && geom->tome == nullptr && geom->parent_space == nullptr);
  EXPECT(SlotHome::get(geom) == 0);
  EXPECT(geom->category_bits == ~0ul && geom->collide_bits == ~0ul);

  int mark = 0;
  dGeomSetData(geom, &mark);
  EXPECT(geom->data == &mark);
  dGeomSetCategoryBits(geom, 0x12345678ul);
  dGeomSetCollideBits(geom, 0x87654321ul);
  EXPECT(geom->category_bits == 0x12345678ul && geom->collide_bits == 0x87654321ul);
  dGeomDisable(geom);
  EXPECT(!(geom->gflags & GEOM_ENABLED));
  dGeomEnable(geom);
  EXPECT(geom->gflags & GEOM_ENABLED);
  dGeomSphereSetRadius(geom, 0);
  EXPECT(geom->gflags & GEOM_ZERO_SIZED);
  dGeomSphereSetRadius(geom, 2);
  EXPECT(!(geom->gflags & GEOM_ZERO_SIZED));

  dGeomSetPosition(geom, 10, 20, 30);
  EXPECT(geom->final_posr->pos == dGeomGetPosition(geom));
  EXPECT(geom->final_posr->R == dGeomGetRotation(geom));
  EXPECT(geom->final_posr->pos[1] == 20);
  EXPECT(geom->gflags & GEOM_AABB_BAD);
  dReal box[6];
  dGeomGetAABB(geom, box);
  EXPECT(!(geom->gflags & GEOM_AABB_BAD));
  EXPECT(box[0] == 8 && box[3] == 22 && std::memcmp(geom->aabb, box, sizeof box) == 0);
  return nullptr;
}

// A new box of sides 2, 3 and 5, capsule of radius 2 and length 3, plane y = 5.
inline const char* misfitOfShapes(dxGeom* box, dxGeom* capsule, dxGeom* plane) {
  const dReal* const side = static_cast<dxBox*>(box)->side;
  EXPECT(side[0] == 2 && side[1] == 3 && side[2] == 5);
  EXPECT(static_cast<dxCapsule*>(capsule)->radius == 2);
  EXPECT(static_cast<dxCapsule*>(capsule)->lz == 3);
  const dReal* const p = static_cast<dxPlane*>(plane)->p;
  EXPECT(p[0] == 0 && p[1] == 1 && p[2] == 0 && p[3] == 5);
  return nullptr;
}

// A new space of a class derived from dxSpace; a geom of no space is added and removed again.
inline const char* misfitOfSpace(dxSpace* space, dxGeom* geom) {
  EXPECT(space->parent_space == nullptr && space->count == 0 && space->first == nullptr);
  EXPECT(space->cleanup == 1 && space->sublevel == 0 && space->lock_count == 0);
  EXPECT(space->tls_kind == dSPACE_TLS_KIND_INIT_VALUE && space->current_geom == nullptr);
  dSpaceAdd(space, geom);
  EXPECT(space->count == 1 && space->first == geom && geom->parent_space == space);
  EXPECT(dSpaceGetNumGeoms(space) == 1 && dSpaceQuery(space, geom));
  EXPECT(dSpaceGetGeom(space, 0) == geom);
  EXPECT(space->current_geom == geom && space->current_index == 0);
  dSpaceSetSublevel(space, 7);
  dSpaceSetCleanup(space, 0);
  EXPECT(space->sublevel == 7 && space->cleanup == 0);
  dSpaceSetManualCleanup(space, 1);
  EXPECT(space->tls_kind == dSPACE_TLS_KIND_MANUAL_VALUE);
  dSpaceSetManualCleanup(space, 0);
  EXPECT(space->tls_kind == dSPACE_TLS_KIND_INIT_VALUE);
  dSpaceClean(space);
  EXPECT(!(geom->gflags & GEOM_DIRTY) && space->lock_count == 0);
  dSpaceRemove(space, geom);
  EXPECT(space->count == 0 && geom->parent_space == nullptr);
  return nullptr;
}

#undef EXPECT

// `space` is new.
inline const char* misfitOfODE(dxSpace* space) {
  dxGeom* const sphere = dCreateSphere(nullptr, 2);
  dxGeom* const box = dCreateBox(nullptr, 2, 3, 5);
  dxGeom* const capsule = dCreateCapsule(nullptr, 2, 3);
  dxGeom* const plane = dCreatePlane(nullptr, 0, 1, 0, 5);
  const char* misfit = misfitOfSphere(sphere);
  if (!misfit) misfit = misfitOfShapes(box, capsule, plane);
  if (!misfit) misfit = misfitOfSpace(space, sphere);
  if (sphere->parent_space) dSpaceRemove(space, sphere);
  // The last one first: the tests' pair recorder takes back the numbers it gave them.
  for (dxGeom* const shape : {plane, capsule, box, sphere}) dGeomDestroy(shape);
  return misfit;
}

}  // namespace ode_parallel_sap
