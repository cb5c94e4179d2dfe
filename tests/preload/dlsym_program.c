/* dlsym_program ODE LIBRARY FUNCTION
 *
 * As programs in C#, in Python's ctypes and by JNI use ODE: no function is linked. Makes a space by
 * FUNCTION of LIBRARY, puts three touching spheres into it, and prints how many pairs there are. */
#include <dlfcn.h>
#include <ode/ode.h>
#include <stdio.h>

static int pairs = 0;

static void count(void* data, dGeomID a, dGeomID b) {
  (void)data, (void)a, (void)b;
  ++pairs;
}

/* The function `name` of a library, which is loaded already or now. */
static void* function(const char* library, const char* name) {
  void* const opened = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  void* const found = opened ? dlsym(opened, name) : NULL;
  if (!found) fprintf(stderr, "%s\n", dlerror());
  return found;
}

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  int (*const init)(unsigned) = (int (*)(unsigned))function(argv[1], "dInitODE2");
  dSpaceID (*const create)(dSpaceID) = (dSpaceID(*)(dSpaceID))function(argv[2], argv[3]);
  dGeomID (*const sphere)(dSpaceID, dReal) =
      (dGeomID(*)(dSpaceID, dReal))function(argv[1], "dCreateSphere");
  void (*const collide)(dSpaceID, void*, dNearCallback*) =
      (void (*)(dSpaceID, void*, dNearCallback*))function(argv[1], "dSpaceCollide");
  if (!init || !create || !sphere || !collide) return 1;
  init(0);
  const dSpaceID space = create(NULL);
  for (int i = 0; i < 3; ++i) sphere(space, 1);
  collide(space, NULL, count);
  printf("%d pairs\n", pairs);
  return 0;
}
