// Whether the ODE in this process is laid out as the private headers say. The build asks about the
// ODE that it found (cmake/check_ode.cpp), the preload library about the one that a program brings.
#pragma once

#include <cstring>
#include <memory>

#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

#define EXPECT(condition) \
  if (!(condition)) return #condition

// Null, or the first expectation that does not hold: what the library writes through the public API
// is read back through the private layout. `space` is new, of a class derived from dxSpace.
inline const char* misfitOfODE(dxSpace* space) {
  struct Destroy {
    void operator()(dxGeom* geom) const { dGeomDestroy(geom); }
  };
  using Own = std::unique_ptr<dxGeom, Destroy>;
  const Own own_sphere(dCreateSphere(nullptr, 2)), box(dCreateBox(nullptr, 2, 3, 5)),
      capsule(dCreateCapsule(nullptr, 2, 3)), plane(dCreatePlane(nullptr, 0, 1, 0, 5));
  dxGeom* const sphere = own_sphere.get();
  EXPECT(sphere->type == dSphereClass && static_cast<dxSphere*>(sphere)->radius == 2);
  const dReal* const side = static_cast<dxBox*>(box.get())->side;
  EXPECT(side[0] == 2 && side[1] == 3 && side[2] == 5);
  const dxCapsule* const round = static_cast<dxCapsule*>(capsule.get());
  EXPECT(round->radius == 2 && round->lz == 3);
  const dReal* const p = static_cast<dxPlane*>(plane.get())->p;
  EXPECT(p[0] == 0 && p[1] == 1 && p[2] == 0 && p[3] == 5);

  EXPECT(sphere->gflags == (GEOM_DIRTY | GEOM_AABB_BAD | GEOM_ENABLED | GEOM_PLACEABLE));
  EXPECT(sphere->data == nullptr && sphere->body == nullptr && sphere->offset_posr == nullptr);
  EXPECT(sphere->next == nullptr && sphere->tome == nullptr && sphere->parent_space == nullptr);
  dGeomSetData(sphere, sphere);
  EXPECT(sphere->data == sphere);
  dGeomSetCategoryBits(sphere, 0x12345678ul);
  dGeomSetCollideBits(sphere, 0x87654321ul);
  EXPECT(sphere->category_bits == 0x12345678ul && sphere->collide_bits == 0x87654321ul);
  dGeomDisable(sphere);
  EXPECT(!(sphere->gflags & GEOM_ENABLED));
  dGeomSphereSetRadius(sphere, 0);
  EXPECT(sphere->gflags & GEOM_ZERO_SIZED);
  dGeomSphereSetRadius(sphere, 2);
  dGeomSetPosition(sphere, 10, 20, 30);
  EXPECT(sphere->final_posr->pos == dGeomGetPosition(sphere));
  EXPECT(sphere->final_posr->R == dGeomGetRotation(sphere));
  EXPECT(sphere->gflags & GEOM_AABB_BAD);
  dReal bounds[6];
  dGeomGetAABB(sphere, bounds);
  EXPECT(!(sphere->gflags & GEOM_AABB_BAD));
  EXPECT(bounds[0] == 8 && bounds[3] == 22 &&
         std::memcmp(sphere->aabb, bounds, sizeof bounds) == 0);

  EXPECT(space->parent_space == nullptr && space->count == 0 && space->first == nullptr);
  EXPECT(space->cleanup == 1 && space->sublevel == 0 && space->lock_count == 0);
  EXPECT(space->tls_kind == dSPACE_TLS_KIND_INIT_VALUE && space->current_geom == nullptr);
  dSpaceAdd(space, sphere);
  EXPECT(space->count == 1 && space->first == sphere && sphere->parent_space == space);
  EXPECT(dSpaceGetNumGeoms(space) == 1 && dSpaceQuery(space, sphere));
  EXPECT(space->dxSpace::getGeom(0) == sphere);  // not the one of the space, which may be another
  EXPECT(space->current_geom == sphere && space->current_index == 0);
  dSpaceSetSublevel(space, 7);
  dSpaceSetCleanup(space, 0);
  EXPECT(space->sublevel == 7 && space->cleanup == 0);
  dSpaceSetManualCleanup(space, 1);
  EXPECT(space->tls_kind == dSPACE_TLS_KIND_MANUAL_VALUE);
  dSpaceClean(space);
  EXPECT(!(sphere->gflags & GEOM_DIRTY) && space->lock_count == 0);
  dSpaceRemove(space, sphere);
  EXPECT(space->count == 0 && sphere->parent_space == nullptr);
  return nullptr;
}

#undef EXPECT

}  // namespace ode_parallel_sap
