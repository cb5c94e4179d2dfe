// Run at the end of configuring: does the library that was found have the layout that the private
// headers that were found describe? A space class made from these headers is used through the
// public API, and what the library writes is read back through the private layout. Exit status 0
// if all agrees; otherwise the first disagreement is printed.
#include <cstdio>
#include <cstdlib>

#include "space/preload/ode_layout.h"

#define CHECK(condition) check((condition), #condition, __LINE__)

namespace {

void check(bool holds, const char* condition, int line) {
  if (holds) return;
  std::printf("check_ode.cpp:%d: expected %s\n", line, condition);
  std::exit(1);
}

// Counts how often the library reaches each virtual function, and is a working space besides.
struct CheckSpace : dxSpace {
  static int alive;
  int adds = 0, removes = 0, dirties = 0, cleans = 0, collides = 0, collides2 = 0;
  int gets = 0, bounds = 0, tests = 0;

  explicit CheckSpace(dSpaceID parent) : dxSpace(parent) {
    type = dSweepAndPruneSpaceClass;
    ++alive;
  }

  // The base class destructor would not reach this class's remove().
  ~CheckSpace() {
    while (first) cleanup ? dGeomDestroy(first) : remove(first);
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
#if dTLS_ENABLED
  const bool has_tls = true;
#else
  const bool has_tls = false;
#endif
  const bool is_double = sizeof(dReal) == sizeof(double);
  CHECK((dCheckConfiguration("ODE_double_precision") != 0) == is_double);
  CHECK((dCheckConfiguration("ODE_single_precision") != 0) != is_double);
  CHECK((dCheckConfiguration("ODE_EXT_mt_collisions") != 0) == has_tls);
}

void checkLayout() {
  CheckSpace* space = new CheckSpace(nullptr);
  const char* const misfit = ode_parallel_sap::misfitOfODE(space);
  check(!misfit, misfit, __LINE__);
  dSpaceDestroy(space);
}

void checkBodies() {
  dWorldID world = dWorldCreate();
  dBodyID body = dBodyCreate(world);
  dGeomID earlier = dCreateSphere(nullptr, 1);
  dGeomID sphere = dCreateSphere(nullptr, 1);
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
  dGeomDestroy(sphere);
  dGeomDestroy(earlier);
  dWorldDestroy(world);
}

void checkStockSpace() {
  dSpaceID space = dSimpleSpaceCreate(nullptr);
  CHECK(space->type == dSimpleSpaceClass);
  dGeomID a = dCreateSphere(space, 1);
  dGeomID b = dCreateSphere(space, 1);
  CHECK(space->first == b && b->next == a && a->next == nullptr);
  CHECK(b->tome == &space->first && a->tome == &b->next);
  CHECK(dSpaceGetGeom(space, 1) == a);
  CHECK(space->current_index == 1 && space->current_geom == a);
  Met met = {space, 0, 0, nullptr, nullptr};
  dSpaceCollide(space, &met, meet);
  CHECK(met.calls == 1 && met.locks == 1 && space->lock_count == 0);
  CHECK(!(a->gflags & (GEOM_DIRTY | GEOM_AABB_BAD)));
  dSpaceSetCleanup(space, 0);
  dSpaceDestroy(space);
  CHECK(a->parent_space == nullptr && b->parent_space == nullptr);
  dGeomDestroy(a);
  dGeomDestroy(b);
}

// Every virtual function that a derived space has is where the library looks for it.
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
  checkLayout();
  checkBodies();
  checkStockSpace();
  checkDerivedSpace();
  checkNestedSpaces();
  dCloseODE();
  std::printf("dxGeom %zu bytes, dxSpace %zu bytes", sizeof(dxGeom), sizeof(dxSpace));
  return 0;
}
