/* A program that knows ODE only: boxes move, come, go, sleep, are disabled and change their bits,
 * some in a space of their own. It prints each frame's pairs by numbers that geoms get in the order
 * in which they are added, which is what the frames of a trace tell (examples/trace/trace-replay
 * --pairs).
 *
 *     trace_program hash|sap [frames]
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <ode/ode.h>

enum { most = 200 };

static dWorldID world;
static dSpaceID space;
static dGeomID geoms[most];
static int count;
static uintptr_t last_number;

static void number(dGeomID geom) {
  dGeomSetData(geom, (void*)++last_number);
}

static void printPair(void* data, dGeomID a, dGeomID b) {
  (void)data;
  printf(" %lu-%lu", (unsigned long)(uintptr_t)dGeomGetData(a),
         (unsigned long)(uintptr_t)dGeomGetData(b));
}

static void addBox(dSpaceID where) {
  const dGeomID box = dCreateBox(where, 1, 1.5, 1);
  if (count % 3 != 0) dGeomSetBody(box, dBodyCreate(world));
  dGeomSetPosition(box, 20 + 0.7 * (count % 6), 20 + 0.8 * (count / 6 % 6), 20 + count / 36);
  number(box);
  geoms[count++] = box;
}

static void move(int frame) {
  int i;
  for (i = frame % 3; i < count; i += 3) {
    const dReal* const at = dGeomGetPosition(geoms[i]);
    dGeomSetPosition(geoms[i], at[0] + 0.1 * ((i + frame) % 5 - 2), at[1] + 0.05, at[2]);
  }
}

/* Another thing in each frame. */
static void edit(int frame) {
  const int i = frame * 7 % count;
  const dGeomID geom = geoms[i];
  const dBodyID body = dGeomGetBody(geom);
  switch (frame % 7) {
    case 0:
      addBox(space);
      break;
    case 1:
      dGeomIsEnabled(geom) ? dGeomDisable(geom) : dGeomEnable(geom);
      break;
    case 2:
      dGeomSetCategoryBits(geom, 1ul << (i % 3));
      dGeomSetCollideBits(geom, ~(1ul << (i % 3)));
      break;
    case 3:
      if (body) dBodyDisable(body);
      break;
    case 4:
      dSpaceRemove(space, geom);
      dSpaceAdd(space, geom);
      number(geom);
      break;
    case 5:
      dGeomDestroy(geom);
      geoms[i] = geoms[--count];
      break;
    default:
      dGeomBoxSetLengths(geom, 2, 1, 0.5);
  }
}

int main(int argc, char** argv) {
  const int frames = argc > 2 ? atoi(argv[2]) : 60;
  int frame, i;
  dSpaceID inner;
  dInitODE2(0);
  world = dWorldCreate();
  space = strcmp(argv[1], "sap") == 0 ? dSweepAndPruneSpaceCreate(0, dSAP_AXES_XZY)
                                      : dHashSpaceCreate(0);
  inner = dSimpleSpaceCreate(space);
  number((dGeomID)inner);
  for (i = 0; i < 3; ++i) {
    dGeomSetPosition(dCreateSphere(inner, 0.5), 21 + i, 21, 20);
    ++last_number;
  }
  for (i = 0; i < 150; ++i) addBox(space);
  for (frame = 1; frame <= frames; ++frame) {
    move(frame);
    if (frame > 1) edit(frame);
    printf("collide %d:", frame);
    dSpaceCollide(space, 0, printPair);
    printf("\n");
  }
  dSpaceDestroy(space);
  dWorldDestroy(world);
  dCloseODE();
  return 0;
}
