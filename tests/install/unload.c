/* unload LIBRARY PRELOAD: is a plug-in that uses the library. Opens it, has two threads find
 * contacts of meshes, for which they may have images of ODE, closes it, and goes on for as long as
 * the threads may need to find their code gone. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

typedef void CollideContacts(dSpaceID, void*, int, const dParallelSAPContactCallbacks*);

enum { kMeshes = 3000 }; /* enough of them for a team of threads, and for images */

static void countContacts(void* contacts, dGeomID a, dGeomID b, const dContactGeom* found, int n) {
  (void)a, (void)b, (void)found, *(long*)contacts += n;
}

/* Whether images of ODE are in the program, if its meshes need them. */
static int hasImages(void) {
  if (dCheckConfiguration("ODE_EXT_mt_collisions")) return 1;
  FILE* const maps = fopen("/proc/self/maps", "r");
  char line[1000];
  int has = 0;
  while (maps && fgets(line, sizeof line, maps)) has |= strstr(line, "ode-image") != NULL;
  if (maps) fclose(maps);
  return has;
}

/* Boxes, each on a square of two triangles. Whether each of them has contacts. */
static int collideMeshes(dSpaceID space, CollideContacts* collide_contacts) {
  static const float corners[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  static const dTriIndex triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
  dTriMeshDataID data = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildSingle(data, corners, sizeof corners[0], 4, triangles, 6,
                              sizeof triangles[0]);
  for (int i = 0; i < kMeshes; ++i) {
    dGeomSetPosition(dCreateTriMesh(space, data, 0, 0, 0), (dReal)3 * i, -100, 0);
    dGeomSetPosition(dCreateBox(space, 1, 1, 1), (dReal)3 * i, -100, (dReal)0.4);
  }
  const dParallelSAPContactCallbacks callbacks = {countContacts, 0, 0, 0};
  long contacts = 0;
  for (int frame = 0; frame < 4; ++frame) collide_contacts(space, &contacts, 1, &callbacks);
  const int all = contacts % 4 == 0 && contacts >= 4 * kMeshes;
  while (dSpaceGetNumGeoms(space) > 0) dGeomDestroy(dSpaceGetGeom(space, 0));
  dGeomTriMeshDataDestroy(data);
  return all && hasImages();
}

/* Returns how many threads had work; 0 if something is wrong. */
static int collide(void* library) {
  dSpaceID (*const create)(dSpaceID) =
      (dSpaceID(*)(dSpaceID))dlsym(library, "dParallelSAPSpaceCreate");
  void (*const set_threads)(dSpaceID, int) =
      (void (*)(dSpaceID, int))dlsym(library, "dParallelSAPSpaceSetNumThreads");
  void (*const get_stats)(dSpaceID, dParallelSAPStats*) =
      (void (*)(dSpaceID, dParallelSAPStats*))dlsym(library, "dParallelSAPSpaceGetStats");
  CollideContacts* const collide_contacts =
      (CollideContacts*)dlsym(library, "dParallelSAPSpaceCollideContacts");
  if (!create || !set_threads || !get_stats || !collide_contacts) return 0;
  dSpaceID space = create(0);
  set_threads(space, 2);
  const int right = collideMeshes(space, collide_contacts);
  dParallelSAPStats stats;
  get_stats(space, &stats);
  dSpaceDestroy(space);
  return right ? stats.threads : 0;
}

static int isLoaded(const char* library) {
  return dlopen(library, RTLD_NOW | RTLD_NOLOAD) != NULL;
}

/* 0 if all is well with what `use` is to be done with a library that is then closed. */
static int openAndClose(const char* name, int (*use)(void*), int wanted) {
  if (isLoaded(name)) return fprintf(stderr, "%s is in the program from the start\n", name);
  void* const library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
  if (!library) return fprintf(stderr, "%s\n", dlerror());
  const int got = use ? use(library) : wanted;
  if (got != wanted) return fprintf(stderr, "%s: %d instead of %d threads\n", name, got, wanted);
  dlclose(library);
  const struct timespec while_threads_wait = {0, 200 * 1000 * 1000};
  nanosleep(&while_threads_wait, NULL);
  if (use && !hasImages()) return fprintf(stderr, "its images of ODE have left\n");
  return isLoaded(name) ? 0 : fprintf(stderr, "%s has left\n", name);
}

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  dInitODE2(0);
  const int wrong = openAndClose(argv[1], collide, 2) || openAndClose(argv[2], NULL, 0);
  dCloseODE();
  return wrong != 0;
}
