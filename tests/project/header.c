#include <ode_parallel_sap/parallel_sap_space.h>

void collide(dSpaceID space, dParallelSAPStats* stats);
void collide(dSpaceID space, dParallelSAPStats* stats) {
  const dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf(0);
  dParallelSAPSpaceCollideContacts(space, 0, 1, &callbacks);
#if defined(__STDC_VERSION__) && __STDC_VERSION__ >= 199901L
  dParallelSAPSpaceCollideContacts(space, 0, 1, &(dParallelSAPContactCallbacks){0, 0, 0, 0});
#endif
  dParallelSAPSpaceGetStats(space, stats);
}
