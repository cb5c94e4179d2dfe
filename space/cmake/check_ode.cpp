// Run at the end of configuring: does the library that was found have the layout that the private
// headers that were found describe? A space class made from these headers is used through the
// public API, and what the library writes is read back through the private layout. Exit status 0
// if all agrees; otherwise the first disagreement is printed.
#include "config.h"

#include <ode/ode.h>

#include "collision_kernel.h"
#include "collision_std.h"
//
#include "space/geom/slot_home.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>

#define CHECK(condition) check((condition), #condition, __LINE__)

namespace {

using ode_parallel_sap::SlotHome;

void check(bool holds, const char* condition, int line) {
  if (holds) return;
  std::printf("check_ode.cpp:%d: expected %s\n", line, condition);
  std::exit(1);
}

// Counts how often the library reaches each virtual function, and is a working space besides.
struct CheckSpace : dxSpace {
  static int alive;
  int adds = 0, removes = 0, dirties = 0, cleans = 0, collides = 0, collides2 = 0;
  int gets = 0, bounds = 0, tests = 0, controls = 0;

  explicit CheckSpace(dSpaceID parent) : dxSpace(parent) {
    type = dSweepAndPruneSpaceClass;
    ++alive;
  }

  // The base class destructor would not reach this class's remove().
  ~CheckSpace() {
    while (first != nullptr) {
      if (cleanup) {
        dGeomDestroy(first);
      } else {
        remove(first);
      }
    }
    --alive;
  }

  dxGeom* getGeom(int i) override {
    ++gets;
    return dxSpace::getGeom(i);
  }
  void add(dxGeom* geom) override {
    ++adds;
    dxSpace::add(geom);
  }
  void remove(dxGeom* geom) override {
    ++removes;
    dxSpace::remove(geom);
  }
  void dirty(dxGeom* geom) override {
    ++dirties;
    dxSpace::dirty(geom);
  }
  void computeAABB() override {
    ++bounds;
    dxSpace::computeAABB();
  }
  int AABBTest(dxGeom* other, dReal box[6]) override {
    ++tests;
    return dxSpace::AABBTest(other, box);
  }
  bool controlGeometry(int control_class, int code, void* value, int* size) override {
    ++controls;
    return control_class == 3 && code == 4 && *static_cast<int*>(value) == 5 &&
           *size == sizeof(int);
  }
  void cleanGeoms() override {
    ++cleans;
    for (dxGeom* geom = first; geom != nullptr; geom = geom->next) {
      geom->recomputeAABB();
      geom->gflags &= ~GEOM_DIRTY;
    }
  }
  void collide(void* data, dNearCallback* callback) override {
    ++collides;
    cleanGeoms();
    callback(data, first, first->next);
  }
  void collide2(void* data, dxGeom* geom, dNearCallback* callback) override {
    ++collides2;
    callback(data, first, geom);
  }
};

int CheckSpace::alive = 0;

struct Met {
  dxSpace* space;
  int calls, locks;
  dGeomID first, second;
};

void meet(void* data, dGeomID first, dGeomID second) {
  Met* met = static_cast<Met*>(data);
  ++met->calls;
  met->locks = met->space->lock_count;
  met->first = first;
  met->second = second;
}

void checkPrecision() {
#if defined(dDOUBLE)
  CHECK(sizeof(dReal) == sizeof(double));
  CHECK(dCheckConfiguration("ODE_double_precision"));
  CHECK(!dCheckConfiguration("ODE_single_precision"));
#else
  CHECK(sizeof(dReal) == sizeof(float));
  CHECK(dCheckConfiguration("ODE_single_precision"));
  CHECK(!dCheckConfiguration("ODE_double_precision"));
#endif
#if dTLS_ENABLED
  CHECK(dCheckConfiguration("ODE_EXT_mt_collisions"));
#else
  CHECK(!dCheckConfiguration("ODE_EXT_mt_collisions"));
#endif
}

// The sizes of the simple classes.
void checkShapes() {
  dGeomID box = dCreateBox(nullptr, 2, 3, 5);
  const dReal* const side = static_cast<dxBox*>(box)->side;
  CHECK(side[0] == 2 && side[1] == 3 && side[2] == 5);
  dGeomDestroy(box);
  dGeomID capsule = dCreateCapsule(nullptr, 2, 3);
  CHECK(static_cast<dxCapsule*>(capsule)->radius == 2 && static_cast<dxCapsule*>(capsule)->lz == 3);
  dGeomDestroy(capsule);
  dGeomID plane = dCreatePlane(nullptr, 0, 1, 0, 5);
  const dReal* const p = static_cast<dxPlane*>(plane)->p;
  CHECK(p[0] == 0 && p[1] == 1 && p[2] == 0 && p[3] == 5);
  dGeomDestroy(plane);
}

// Each field of a geom that the library made: written by the public API, read in the layout.
void checkGeomLayout() {
  dWorldID world = dWorldCreate();
  dBodyID body = dBodyCreate(world);
  dSpaceID space = dSimpleSpaceCreate(nullptr);
  dGeomID earlier = dCreateSphere(space, 1);
  dGeomID sphere = dCreateSphere(space, dReal(0.75));
  int mark = 0;

  CHECK(sphere->type == dSphereClass);
  CHECK(sphere->gflags == (GEOM_DIRTY | GEOM_AABB_BAD | GEOM_ENABLED | GEOM_PLACEABLE));
  CHECK(static_cast<dxSphere*>(sphere)->radius == dReal(0.75));
  CHECK(sphere->data == nullptr && sphere->body == nullptr && sphere->offset_posr == nullptr);
  CHECK(SlotHome::takes_tome || SlotHome::get(sphere) == 0);
  CHECK(sphere->category_bits == ~0ul && sphere->collide_bits == ~0ul);
  CHECK(sphere->parent_space == space);
  CHECK(sphere->next == earlier && earlier->next == nullptr);
  CHECK(sphere->tome == &space->first && earlier->tome == &sphere->next);

  dGeomSetData(sphere, &mark);
  CHECK(sphere->data == &mark);
  dGeomSetCategoryBits(sphere, 0x12345678ul);
  dGeomSetCollideBits(sphere, 0x87654321ul);
  CHECK(sphere->category_bits == 0x12345678ul && sphere->collide_bits == 0x87654321ul);
  dGeomDisable(sphere);
  CHECK(!(sphere->gflags & GEOM_ENABLED));
  dGeomEnable(sphere);
  CHECK(sphere->gflags & GEOM_ENABLED);
  dGeomSphereSetRadius(sphere, 0);
  CHECK(sphere->gflags & GEOM_ZERO_SIZED);
  dGeomSphereSetRadius(sphere, 2);
  CHECK(!(sphere->gflags & GEOM_ZERO_SIZED));

  dGeomSetPosition(sphere, 10, 20, 30);
  CHECK(sphere->final_posr->pos == dGeomGetPosition(sphere));
  CHECK(sphere->final_posr->R == dGeomGetRotation(sphere));
  CHECK(sphere->final_posr->pos[1] == 20);
  CHECK(sphere->gflags & GEOM_AABB_BAD);
  dReal box[6];
  dGeomGetAABB(sphere, box);
  CHECK(!(sphere->gflags & GEOM_AABB_BAD));
  CHECK(std::memcmp(sphere->aabb, box, sizeof box) == 0);
  CHECK(box[0] == 8 && box[1] == 12 && box[2] == 18 && box[3] == 22 && box[4] == 28 &&
        box[5] == 32);

  dGeomSetBody(sphere, body);
  dGeomSetBody(earlier, body);
  CHECK(sphere->body == body && earlier->body == body);
  CHECK(earlier->body_next == sphere && sphere->body_next == nullptr);
  dBodySetPosition(body, 1, 2, 3);
  CHECK(sphere->final_posr->pos[2] == 3);
  dGeomSetOffsetPosition(sphere, 0, 0, 4);
  CHECK(sphere->offset_posr != nullptr && sphere->offset_posr->pos[2] == 4);
  CHECK(sphere->gflags & GEOM_POSR_BAD);
  sphere->recomputePosr();
  CHECK(sphere->final_posr->pos[2] == 7);
  CHECK(dGeomGetPosition(sphere)[2] == 7);

  dSpaceDestroy(space);
  dWorldDestroy(world);
}

// Likewise each field of a space that the library made, up to the last one.
void checkSpaceLayout() {
  dSpaceID space = dSimpleSpaceCreate(nullptr);
  CHECK(space->type == dSimpleSpaceClass);
  CHECK(space->count == 0 && space->first == nullptr);
  CHECK(space->cleanup == 1 && space->sublevel == 0 &&
        space->tls_kind == dSPACE_TLS_KIND_INIT_VALUE);
  CHECK(space->current_geom == nullptr && space->lock_count == 0);

  dGeomID a = dCreateSphere(space, 1);
  dGeomID b = dCreateSphere(space, 1);
  CHECK(space->count == 2 && space->first == b);
  dSpaceSetSublevel(space, 7);
  CHECK(space->sublevel == 7);
  dSpaceSetManualCleanup(space, 1);
  CHECK(space->tls_kind == dSPACE_TLS_KIND_MANUAL_VALUE);
  dSpaceSetManualCleanup(space, 0);
  CHECK(space->tls_kind == dSPACE_TLS_KIND_INIT_VALUE);
  CHECK(dSpaceGetGeom(space, 1) == a);
  CHECK(space->current_index == 1 && space->current_geom == a);

  Met met = {space, 0, 0, nullptr, nullptr};
  dSpaceCollide(space, &met, meet);
  CHECK(met.calls == 1 && met.locks == 1 && space->lock_count == 0);
  CHECK(!(a->gflags & (GEOM_DIRTY | GEOM_AABB_BAD)));

  dSpaceSetCleanup(space, 0);
  CHECK(space->cleanup == 0);
  dSpaceDestroy(space);
  CHECK(a->parent_space == nullptr && b->parent_space == nullptr);
  dGeomDestroy(a);
  dGeomDestroy(b);
}

// Every virtual function of a derived space is where the library looks for it.
void checkDerivedSpace() {
  CheckSpace* space = new CheckSpace(nullptr);
  CHECK(dGeomIsSpace(space) && dGeomGetClass(space) == dSweepAndPruneSpaceClass);
  CHECK(dGeomGetSpace(space) == nullptr && dSpaceGetCleanup(space) == 1);

  dGeomID a = dCreateSphere(space, 1);
  dGeomID b = dCreateBox(nullptr, 2, 2, 2);
  dSpaceAdd(space, b);
  CHECK(space->adds == 2 && dSpaceGetNumGeoms(space) == 2);
  CHECK(dSpaceQuery(space, a) && dSpaceQuery(space, b));
  CHECK(dSpaceGetGeom(space, 0) == b && dSpaceGetGeom(space, 1) == a && space->gets == 2);

  dSpaceClean(space);
  CHECK(space->cleans == 1 && !(a->gflags & GEOM_DIRTY));
  dGeomSetPosition(a, 3, 0, 0);
  CHECK(space->dirties == 1 && dSpaceGetGeom(space, 0) == a);

  dReal box[6];
  dGeomGetAABB(space, box);
  CHECK(space->bounds == 1 && box[0] == -1 && box[1] == 4);

  int value = 5, size = sizeof value;
  CHECK(dGeomLowLevelControl(space, 3, 4, &value, &size) == 1);
  CHECK(space->controls == 1);

  Met met = {space, 0, 0, nullptr, nullptr};
  dSpaceCollide(space, &met, meet);
  CHECK(space->collides == 1 && met.calls == 1 && met.first == a && met.second == b);
  dGeomID probe = dCreateSphere(nullptr, 1);
  dSpaceCollide2(space, probe, &met, meet);
  CHECK(space->collides2 == 1 && met.calls == 2 && met.second == probe);
  dGeomDestroy(probe);

  dSpaceRemove(space, b);
  CHECK(space->removes == 1 && dSpaceGetNumGeoms(space) == 1 && dGeomGetSpace(b) == nullptr);
  dSpaceAdd(space, b);
  dGeomDestroy(b);
  CHECK(space->removes == 2 && dSpaceGetNumGeoms(space) == 1);
  dSpaceDestroy(space);
  CHECK(CheckSpace::alive == 0);
}

void checkNestedSpaces() {
  dSpaceID outer = dSimpleSpaceCreate(nullptr);
  CheckSpace* inner = new CheckSpace(outer);
  dCreateSphere(inner, 1);
  CheckSpace* kept = new CheckSpace(nullptr);
  dGeomID survivor = dCreateSphere(kept, 1);
  CHECK(dSpaceQuery(outer, inner) && dSpaceGetNumGeoms(outer) == 1);
  dGeomID beside = dCreateSphere(outer, 1);

  Met met = {outer, 0, 0, nullptr, nullptr};
  dSpaceCollide(outer, &met, meet);
  CHECK(met.calls == 1 && met.first == beside && met.second == inner);
  CHECK(inner->tests == 1 && inner->cleans == 1);
  CHECK(!(inner->gflags & GEOM_DIRTY));
  dGeomSetPosition(inner->first, 5, 0, 0);
  CHECK((inner->gflags & GEOM_DIRTY) && outer->first == inner);

  dSpaceSetCleanup(kept, 0);
  dSpaceDestroy(kept);
  CHECK(dGeomGetSpace(survivor) == nullptr && dGeomGetClass(survivor) == dSphereClass);
  dGeomDestroy(survivor);
  dSpaceDestroy(outer);
  CHECK(CheckSpace::alive == 0);
}

}  // namespace

int main() {
  std::setvbuf(stdout, nullptr, _IONBF, 0);
  dInitODE2(0);
  checkPrecision();
  checkShapes();
  checkGeomLayout();
  checkSpaceLayout();
  checkDerivedSpace();
  checkNestedSpaces();
  dCloseODE();
  std::printf("dxGeom %zu bytes, dxSpace %zu bytes, %s tome_ex", sizeof(dxGeom), sizeof(dxSpace),
              SlotHome::takes_tome ? "without" : "with");
  return 0;
}
