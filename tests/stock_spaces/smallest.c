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

static dSpaceID touch_at_zero(void) {
  dSpaceID space = dHashSpaceCreate(0);
  box(space, 0.4, 0.4, 0.2499), box(space, 0.4, 0.4, 0.7498);
  return space;
}

static dSpaceID touch_deep_below(void) {
  dSpaceID space = dHashSpaceCreate(0);
  box(space, 1.4, 0.4, -100.1), box(space, 1.4, 0.4, -99.6001);
  return space;
}

static dSpaceID far_away(void) {
  dSpaceID space = dHashSpaceCreate(0);
  box(space, 1e10, 0, 0), box(space, 0, 0, 0);
  return space;
}

static dSpaceID added_again(void) {
  dSpaceID space = dHashSpaceCreate(0);
  dGeomID moved = box(space, 5, 5, 5), again = box(space, 5.1, 5.1, 5.1);
  dSpaceClean(space);
  dGeomSetPosition(moved, 5, 5, 5.1);
  dSpaceRemove(space, again);
  dSpaceAdd(space, again);
  return space;
}

static dSpaceID closer_than_floats(void) {
  dSpaceID space = dSweepAndPruneSpaceCreate(0, dSAP_AXES_XYZ);
  box(space, 5, 5, 5), box(space, 5.5 + 1e-8, 5, 5);
  return space;
}

static dSpaceID under_a_plane(void) {
  dSpaceID space = dSweepAndPruneSpaceCreate(0, dSAP_AXES_XYZ);
  dCreatePlane(space, 0, 0, 1, 0), box(space, 5, 5, 5);
  return space;
}

static dSpaceID inner_sweep_and_prune(void) {
  dSpaceID space = dHashSpaceCreate(0);
  box(dSweepAndPruneSpaceCreate(space, dSAP_AXES_XYZ), 5, 5, 5), box(space, 50, 5, 5);
  return space;
}

static dSpaceID quadtree(void) {
  const dVector3 centre = {0, 0, 0, 0}, extents = {10, 10, 10, 0};
  return dQuadTreeSpaceCreate(0, centre, extents, 3);
}

static dSpaceID geom_by_number(void) {
  dSpaceID space = quadtree();
  box(space, 5, 5, 5);
  dSpaceGetGeom(space, 0);
  return space;
}

static dSpaceID out_of_quadtree(void) {
  dSpaceID old = quadtree(), space = dSweepAndPruneSpaceCreate(0, dSAP_AXES_XYZ);
  dGeomID first = box(old, 5, 5, 5), second = box(old, 5, 5, 5.1);
  dSpaceSetCleanup(old, 0);
  dSpaceDestroy(old);
  dSpaceAdd(space, first), dSpaceAdd(space, second);
  return space;
}

static const struct Fault {
  const char* name;
  dSpaceID (*make)(void);
  int owed;
} faults[] = {
    {"dHashSpace, boxes that touch near z = 0", touch_at_zero, 1},
    {"dHashSpace, boxes that overlap at z = -100", touch_deep_below, 1},
    {"dHashSpace, a box at 1e10", far_away, 0},
    {"dHashSpace, a box added again", added_again, 1},
    {"dSweepAndPruneSpace, a gap of 1e-8", closer_than_floats, sizeof(dReal) == sizeof(float)},
    {"dSweepAndPruneSpace, a box far above a plane", under_a_plane, 0},
    {"dSweepAndPruneSpace, as a sub-space", inner_sweep_and_prune, 0},
    {"dQuadTreeSpace, dSpaceGetGeom", geom_by_number, 0},
    {"dQuadTreeSpace, geoms that outlive it", out_of_quadtree, 1}};

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
    dSpaceCollide(faults[i].make(), &pairs, count);
    printf("%d reported, %d owed\n", pairs, faults[i].owed);
  }
  return 0;
}
