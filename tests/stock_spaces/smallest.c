/* The smallest programs in which ODE's spaces report other pairs than dSimpleSpace, or end the
 * program. Prints a line for each: what was reported, and what is owed. Under the preload library
 * both are the same. */
#include <ode/ode.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

static jmp_buf aborted;

static void leave(int number, const char* format, va_list arguments) {
  (void)number, (void)format, (void)arguments;
  longjmp(aborted, 1);
}

static void count(void* pairs, dGeomID a, dGeomID b) {
  (void)a, (void)b;
  ++*(int*)pairs;
}

static dGeomID box(dSpaceID space, double x, double y, double z) {
  dGeomID geom = dCreateBox(space, 0.5, 0.5, 0.5);
  dGeomSetPosition(geom, (dReal)x, (dReal)y, (dReal)z);
  return geom;
}

static dSpaceID hash(dSpaceID parent) {
  return dHashSpaceCreate(parent);
}
static dSpaceID sap(dSpaceID parent) {
  return dSweepAndPruneSpaceCreate(parent, dSAP_AXES_XYZ);
}
static dSpaceID quadtree(dSpaceID parent) {
  const dVector3 centre = {0, 0, 0, 0}, extents = {10, 10, 10, 0};
  return dQuadTreeSpaceCreate(parent, centre, extents, 3);
}

static void touch_at_zero(dSpaceID space) {
  box(space, 0.4, 0.4, 0.2499), box(space, 0.4, 0.4, 0.7498);
}

static void touch_deep_below(dSpaceID space) {
  box(space, 1.4, 0.4, -100.1), box(space, 1.4, 0.4, -99.6001);
}

static void far_away(dSpaceID space) {
  box(space, 1e10, 0, 0), box(space, 0, 0, 0);
}

static void added_again(dSpaceID space) {
  dGeomID moved = box(space, 5, 5, 5), again = box(space, 5.1, 5.1, 5.1);
  dSpaceClean(space);
  dGeomSetPosition(moved, 5, 5, 5.1);
  dSpaceRemove(space, again);
  dSpaceAdd(space, again);
}

static void closer_than_floats(dSpaceID space) {
  box(space, 5, 5, 5), box(space, 5.5 + 1e-8, 5, 5);
}

static void under_a_plane(dSpaceID space) {
  dCreatePlane(space, 0, 0, 1, 0), box(space, 5, 5, 5);
}

static void inner_sweep_and_prune(dSpaceID space) {
  box(sap(space), 5, 5, 5), box(space, 50, 5, 5);
}

static void geom_by_number(dSpaceID space) {
  box(space, 5, 5, 5);
  dSpaceGetGeom(space, 0);
}

static void out_of_quadtree(dSpaceID space) {
  dSpaceID old = quadtree(0);
  dGeomID first = box(old, 5, 5, 5), second = box(old, 5, 5, 5.1);
  dSpaceSetCleanup(old, 0);
  dSpaceDestroy(old);
  dSpaceAdd(space, first), dSpaceAdd(space, second);
}

static const struct Fault {
  const char* name;
  dSpaceID (*make)(dSpaceID parent);
  void (*fill)(dSpaceID space);
  int owed;
} faults[] = {
    {"dHashSpace, boxes that touch near z = 0", hash, touch_at_zero, 1},
    {"dHashSpace, boxes that overlap at z = -100", hash, touch_deep_below, 1},
    {"dHashSpace, a box at 1e10", hash, far_away, 0},
    {"dHashSpace, a box added again", hash, added_again, 1},
    {"dSweepAndPruneSpace, a gap of 1e-8", sap, closer_than_floats, sizeof(dReal) == sizeof(float)},
    {"dSweepAndPruneSpace, a box far above a plane", sap, under_a_plane, 0},
    {"dSweepAndPruneSpace, as a sub-space", hash, inner_sweep_and_prune, 0},
    {"dQuadTreeSpace, dSpaceGetGeom", quadtree, geom_by_number, 0},
    {"dQuadTreeSpace, geoms that outlive it", sap, out_of_quadtree, 1}};

int main(void) {
  dInitODE2(0);
  dSetDebugHandler(leave);
  for (unsigned i = 0; i < sizeof faults / sizeof *faults; ++i) {
    printf("%s: ", faults[i].name);
    if (setjmp(aborted)) {
      printf("aborts, %d owed\n", faults[i].owed);
      continue;
    }
    int pairs = 0;
    dSpaceID space = faults[i].make(0);
    faults[i].fill(space);
    dSpaceCollide(space, &pairs, count);
    printf("%d reported, %d owed\n", pairs, faults[i].owed);
  }
  return 0;
}
