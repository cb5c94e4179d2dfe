/* Changes geoms and bodies in all ways of which ODE tells no space, in a scene whose other geoms
 * stand still, and prints in every frame which pairs there are. */
#include <ode/ode.h>
#include <stdio.h>

enum { boxes = 200, ways = 8, first_asleep = 55 };

static dGeomID geoms[boxes];

static void hash(void* sum, dGeomID a, dGeomID b) {
  const size_t first = (size_t)dGeomGetData(a), second = (size_t)dGeomGetData(b);
  const size_t low = first < second ? first : second, high = first < second ? second : first;
  *(size_t*)sum += (low * boxes + high) * (low * boxes + high + 7);
}

/* Changes a box and, two frames later, changes it back. */
static void change(int way, dGeomID geom, int back) {
  const dBodyID body = dGeomGetBody(geom);
  switch (way) {
    case 0:
      dGeomSetCategoryBits(geom, back ? ~0ul : 0);
      break;
    case 1:
      dGeomSetCollideBits(geom, back ? ~0ul : 0);
      break;
    case 2:
      (back ? dGeomEnable : dGeomDisable)(geom);
      break;
    case 3:
      if (!back) dGeomSetBody(geom, NULL);
      break;
    case 4:
      if (!back) dBodyDestroy(body);
      break;
    case 5:
      (back ? dBodyDisable : dBodyEnable)(body);
      break;
    case 6:
      back ? dBodyDisable(body) : dBodySetAutoDisableFlag(body, 0);
      break;
    default:
      back ? dBodyDisable(body) : dBodySetAutoDisableDefaults(body);
  }
}

static void printPairs(const char* what, int way, dSpaceID space) {
  size_t sum = 0;
  dSpaceCollide(space, &sum, hash);
  printf("%s %d: %zu\n", what, way, sum);
}

int main(void) {
  dInitODE2(0);
  const dWorldID world = dWorldCreate();
  const dWorldID other_world = dWorldCreate();
  const dSpaceID space = dHashSpaceCreate(0);
  for (size_t i = 0; i < boxes; ++i) {
    geoms[i] = dCreateBox(space, 1, 1, 1);
    dGeomSetData(geoms[i], (void*)i);
    /* Two of one body, which make no pair until it is gone. */
    const dBodyID body =
        i % 10 == 1 ? dGeomGetBody(geoms[i - 1]) : dBodyCreate(i < boxes / 2 ? world : other_world);
    dGeomSetBody(geoms[i], body);
    if (i % 10 == 1)
      dGeomSetOffsetPosition(geoms[i], (dReal)0.75, 0, 0);
    else
      dGeomSetPosition(geoms[i], (dReal)(0.75 * (double)i), 0, 0);
    if (i >= first_asleep && i < boxes / 2) dBodyDisable(body);
  }
  /* Either bits of theirs decide alone. */
  dGeomSetCollideBits(geoms[10], 0);
  dGeomSetCategoryBits(geoms[20], 0);
  for (int frame = 0; frame < 3; ++frame) printPairs("before", frame, space);
  for (int way = 0; way < ways; ++way) {
    change(way, geoms[10 * way + 10], 0);
    printPairs("changed", way, space);
    printPairs("still", way, space);
    if (dGeomGetBody(geoms[10 * way + 10])) change(way, geoms[10 * way + 10], 1);
    printPairs("back", way, space);
  }
  dWorldDestroy(other_world);
  printPairs("world", 0, space);
  dSpaceDestroy(space);
  dWorldDestroy(world);
  dCloseODE();
  return 0;
}
