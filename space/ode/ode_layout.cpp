#include "space/ode/ode_layout.h"

#include "space/ode/ode_space.h"

namespace ode_parallel_sap {

namespace {

#define EXPECT(condition) \
  if (!(condition)) return #condition

const char* misfitOfGeom(dxGeom* geom) {
  int mark = 0;
  dGeomSetData(geom, &mark);
  dGeomSetCategoryBits(geom, 0x12345678ul);
  dGeomSetCollideBits(geom, 0x07654321ul);
  dGeomSetPosition(geom, 10, 20, 30);

  EXPECT(geom->type == dSphereClass);
  EXPECT(geom->gflags == (GEOM_DIRTY | GEOM_AABB_BAD | GEOM_ENABLED | GEOM_PLACEABLE));
  EXPECT(geom->data == &mark && geom->body == nullptr);
  EXPECT(geom->final_posr->pos == dGeomGetPosition(geom));
  EXPECT(geom->next == nullptr && geom->tome == nullptr && geom->parent_space == nullptr);
  EXPECT(SlotHome::get(geom) == 0);
  EXPECT(geom->category_bits == 0x12345678ul && geom->collide_bits == 0x07654321ul);
  dReal box[6];
  dGeomGetAABB(geom, box);
  EXPECT(geom->aabb[0] == 8 && geom->aabb[5] == 32);
  EXPECT(!(geom->gflags & GEOM_AABB_BAD));
  return nullptr;
}

const char* misfitOfSpace(dxSpace* space, dxGeom* geom) {
  dSpaceAdd(space, geom);
  EXPECT(space->count == 1 && space->first == geom && geom->parent_space == space);
  EXPECT(dSpaceGetNumGeoms(space) == 1 && dSpaceQuery(space, geom));
  dSpaceSetSublevel(space, 7);
  dSpaceSetCleanup(space, 0);
  EXPECT(space->sublevel == 7 && space->cleanup == 0);
  dSpaceClean(space);
  EXPECT(!(geom->gflags & GEOM_DIRTY) && space->lock_count == 0);
  dSpaceRemove(space, geom);
  EXPECT(space->count == 0 && geom->parent_space == nullptr);
  return nullptr;
}

const char* misfitOfShapes(dxGeom* sphere, dxGeom* box, dxGeom* capsule, dxGeom* plane) {
  EXPECT(static_cast<dxSphere*>(sphere)->radius == 2);
  const dReal* const side = static_cast<dxBox*>(box)->side;
  EXPECT(side[0] == 2 && side[1] == 3 && side[2] == 5);
  EXPECT(static_cast<dxCapsule*>(capsule)->radius == 2 &&
         static_cast<dxCapsule*>(capsule)->lz == 3);
  const dReal* const p = static_cast<dxPlane*>(plane)->p;
  EXPECT(p[0] == 0 && p[1] == 1 && p[2] == 0 && p[3] == 5);
  return nullptr;
}

#undef EXPECT

}  // namespace

const char* misfitOfODE() {
  dxGeom* const geom = dCreateSphere(nullptr, 2);
  const char* misfit = misfitOfGeom(geom);
  if (!misfit) {
    ParallelSAPSpace space(nullptr);
    misfit = misfitOfSpace(&space, geom);
    if (geom->parent_space) dSpaceRemove(&space, geom);
  }
  dxGeom* const box = dCreateBox(nullptr, 2, 3, 5);
  dxGeom* const capsule = dCreateCapsule(nullptr, 2, 3);
  dxGeom* const plane = dCreatePlane(nullptr, 0, 1, 0, 5);
  if (!misfit) misfit = misfitOfShapes(geom, box, capsule, plane);
  // The last one first: the tests' pair recorder takes back the numbers it gave them.
  for (dxGeom* const shape : {plane, capsule, box, geom}) dGeomDestroy(shape);
  return misfit;
}

}  // namespace ode_parallel_sap
