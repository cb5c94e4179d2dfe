/* Prints the pairs of a hash space that has one of each kind that a variable of the environment
 * leaves out or adds: two geoms without bodies, two sleepers, a box and an oblique plane that it is
 * clear of, two boxes a twentieth apart, and two awake ones that touch, which nothing leaves out.
 * Each pair has bits of its own, so there is no other. The rest makes the scene large enough for a
 * tolerance: the pairs of smaller ones are tested by their exact bounds. */
#include <ode/ode.h>
#include <stdio.h>

static const char* const kinds[] = {"static", "asleep", "plane", "near", "awake", "other"};
enum { frames = 3, others = 200, of_no_kind = 5 };

static dGeomID mark(dGeomID geom, int kind) {
  dGeomSetData(geom, (void*)kinds[kind]);
  dGeomSetCategoryBits(geom, 1ul << kind);
  dGeomSetCollideBits(geom, 1ul << kind);
  return geom;
}

static dBodyID addBox(dSpaceID space, dWorldID world, int kind, dReal x) {
  const dGeomID box = mark(dCreateBox(space, 1, 1, 1), kind);
  const dBodyID body = world ? dBodyCreate(world) : NULL;
  if (body) dGeomSetBody(box, body);
  dGeomSetPosition(box, (dReal)(10 * kind) + x, 0, 0);
  return body;
}

static void print(void* data, dGeomID a, dGeomID b) {
  (void)data, (void)b;
  printf(" %s", (const char*)dGeomGetData(a));
}

int main(void) {
  dInitODE2(0);
  const dWorldID world = dWorldCreate();
  const dSpaceID space = dHashSpaceCreate(0);
  for (int i = 0; i < 2; ++i) {
    const dReal x = (dReal)i / 2;
    addBox(space, NULL, 0, x);
    dBodyDisable(addBox(space, world, 1, x));
    addBox(space, world, 3, (dReal)(1.05 * i));
    addBox(space, world, 4, x);
  }
  addBox(space, world, 2, 0);
  mark(dCreatePlane(space, 1, 1, 1, -100), 2);
  for (int i = 0; i < others; ++i)
    dGeomSetPosition(mark(dCreateSphere(space, 1), of_no_kind), (dReal)(10 * i), 100, 0);
  for (int frame = 0; frame < frames; ++frame) {
    dSpaceCollide(space, NULL, print);
    puts("");
  }
  dSpaceDestroy(space);
  dWorldDestroy(world);
  dCloseODE();
  return 0;
}
