/* account_program [LIBRARY]
 *
 * Does what account.sh knows the numbers of: two hash spaces with 201 spheres in a row, each of
 * which touches the next, the first 100 on sleeping bodies, and an oblique plane that all are clear
 * of; five dSpaceCollide of each, with a callback that takes its time; one
 * dSpaceCollide2 of each with a group of 150 geoms. One of the spaces is left at the end. With
 * LIBRARY, which the preload library has loaded, five dParallelSAPSpaceCollideContacts of each,
 * too. */
#include <dlfcn.h>
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>
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

static void ignoreContacts(void* data, dGeomID a, dGeomID b, const dContactGeom* contacts,
                           int count) {
  (void)data, (void)a, (void)b, (void)contacts, (void)count;
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

static void exercise(dSpaceID space, dWorldID world, const char* library) {
  row(space, spheres, 0, world, 100);
  dCreatePlane(space, 1, 1, 1, -100);
  for (int i = 0; i < frames; ++i) dSpaceCollide(space, NULL, waste);

  const dSpaceID group = dSimpleSpaceCreate(0);
  row(group, group_size, 1000, NULL, 0);
  dSpaceCollide2((dGeomID)space, (dGeomID)group, NULL, ignorePair);
  dSpaceDestroy(group);

  if (!library) return;
  void* const handle = dlopen(library, RTLD_NOW | RTLD_NOLOAD);
  __typeof__(&dParallelSAPSpaceCollideContacts) collideContacts = NULL;
  if (handle) *(void**)&collideContacts = dlsym(handle, "dParallelSAPSpaceCollideContacts");
  const dParallelSAPContactCallbacks callbacks = {ignoreContacts, NULL, NULL, NULL};
  for (int i = 0; i < frames && collideContacts; ++i) collideContacts(space, NULL, 4, &callbacks);
}

int main(int argc, char** argv) {
  dInitODE2(0);
  const dWorldID world = dWorldCreate();
  for (int left = 0; left <= 1; ++left) {
    const dSpaceID space = dHashSpaceCreate(0);
    exercise(space, world, argc > 1 ? argv[1] : NULL);
    if (!left) dSpaceDestroy(space);
  }
  puts("done");
  return 0;
}
