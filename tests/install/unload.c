/* unload LIBRARY PRELOAD: is a plug-in that uses the library. Opens it, has two threads collide a
 * scene, closes it, and goes on for as long as the threads may need to find their code gone. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>
#include <stdio.h>
#include <time.h>

enum { kSide = 24, kGeoms = kSide * kSide * kSide }; /* enough of them for a team of threads */

static void count(void* pairs, dGeomID a, dGeomID b) {
  (void)a, (void)b, ++*(long*)pairs;
}

/* Returns how many threads found the pairs; 0 if something is wrong. */
static int collide(void* library) {
  dSpaceID (*const create)(dSpaceID) =
      (dSpaceID(*)(dSpaceID))dlsym(library, "dParallelSAPSpaceCreate");
  void (*const set_threads)(dSpaceID, int) =
      (void (*)(dSpaceID, int))dlsym(library, "dParallelSAPSpaceSetNumThreads");
  void (*const get_stats)(dSpaceID, dParallelSAPStats*) =
      (void (*)(dSpaceID, dParallelSAPStats*))dlsym(library, "dParallelSAPSpaceGetStats");
  if (!create || !set_threads || !get_stats) return 0;
  dSpaceID space = create(0);
  set_threads(space, 2);
  for (int i = 0; i < kGeoms; ++i)
    dGeomSetPosition(dCreateBox(space, 1, 1, 1), (dReal)0.9 * (i % kSide),
                     (dReal)1.1 * (i / kSide % kSide), (dReal)1.1 * (i / kSide / kSide));
  long pairs = 0;
  dSpaceCollide(space, &pairs, count);
  dParallelSAPStats stats;
  get_stats(space, &stats);
  dSpaceDestroy(space);
  return pairs == (kSide - 1) * kSide * kSide ? stats.threads : 0;
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
  return isLoaded(name) ? 0 : fprintf(stderr, "%s has left\n", name);
}

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  dInitODE2(0);
  const int wrong = openAndClose(argv[1], collide, 2) || openAndClose(argv[2], NULL, 0);
  dCloseODE();
  return wrong != 0;
}
