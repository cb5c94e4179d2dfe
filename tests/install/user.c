/* The smallest program that uses the library. */
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

static void count(void* pairs, dGeomID a, dGeomID b) {
  (void)a, (void)b, ++*(int*)pairs;
}

int main(void) {
  int pairs = 0;
  dInitODE2(0);
  dSpaceID space = dParallelSAPSpaceCreate(0);
  dCreateSphere(space, 1), dCreateSphere(space, 1), dCreateSphere(space, 1);
  dSpaceCollide(space, &pairs, count);
  dSpaceDestroy(space);
  dCloseODE();
  return pairs == 3 ? 0 : 1;
}
