/* account_program [collide]
 *
 * Does what account.sh knows the numbers of: two hash spaces with 201 spheres in a row, each of
 * which touches the next, the first 100 on sleeping bodies, and an oblique plane that all are clear
 * of; five dSpaceCollide of each, with a callback that takes its time, or with `collide` calls
 * dCollide; one dSpaceCollide2 of each with a group of 150 geoms. One of the spaces is left at the
 * end. */
#include <ode/ode.h>
#include <stdio.h>
#include <time.h>

enum { spheres = 201, group_size = 150, frames = 5 };

static void waste(void* data, dGeomID a, dGeomID b) {
  const struct timespec time = {0, 20000};
  (void)data, (void)a, (void)b;
  nanosleep(&time, NULL);
}

static void ignorePair(void* data, dGeomID a, dGeomID b) {
  (void)data, (void)a, (void)b;
}

static void collidePair(void* data, dGeomID a, dGeomID b) {
  dContactGeom contacts[4];
  (void)data, (void)dCollide(a, b, 4, contacts, sizeof contacts[0]);
}

static void row(dSpaceID space, int count, dReal x, dWorldID world, int asleep) {
  for (int i = 0; i < count; ++i) {
    const dGeomID sphere = dCreateSphere(space, (dReal)0.6);
    if (i < asleep) {
      dGeomSetBody(sphere, dBodyCreate(world));
      dBodyDisable(dGeomGetBody(sphere));
    }
    dGeomSetPosition(sphere, x + (dReal)i, 0, 0);
  }
}

static void exercise(dSpaceID space, dWorldID world, dNearCallback* callback) {
  row(space, spheres, 0, world, 100);
  dCreatePlane(space, 1, 1, 1, -100);
  for (int i = 0; i < frames; ++i) dSpaceCollide(space, NULL, callback);

  const dSpaceID group = dSimpleSpaceCreate(0);
  row(group, group_size, 1000, NULL, 0);
  dSpaceCollide2((dGeomID)space, (dGeomID)group, NULL, ignorePair);
  dSpaceDestroy(group);
}

int main(int argc, char** argv) {
  dInitODE2(0);
  const dWorldID world = dWorldCreate();
  for (int left = 0; left <= 1; ++left) {
    const dSpaceID space = dHashSpaceCreate(0);
    exercise(space, world, argc > 1 && argv[1] ? collidePair : waste);
    if (!left) dSpaceDestroy(space);
  }
  puts("done");
  return 0;
}
