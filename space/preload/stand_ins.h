/* What the preload library (space/preload) asks of the library it loads, which exports it for that.
 * Not for users: it is in no header that is installed, and both libraries come from one build. */
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef int dParallelSAPCollideFunction(dGeomID o1, dGeomID o2, int flags, dContactGeom* contact,
                                        int skip);

/* A stand-in is a parallel SAP space that answers the class of the stock space whose place it takes
 * (dSpaceGetClass, dGeomGetClass), so that programs that ask find what they made. */
typedef struct dParallelSAPStandIns {
  /* Null, or what about the ODE of this process differs from the private headers of the build. */
  const char* (*misfit)(void);
  dSpaceID (*create)(dSpaceID parent, int space_class);
  /* Writes to stderr where the time of all stand-ins went, those that are gone included. */
  void (*report)(void);
  /* The dCollide behind the preload library's, which the library calls; before the first space. */
  void (*set_collide)(dParallelSAPCollideFunction* collide);
  /* What dCollide is to return, or -1: dCollide is to be called. */
  dParallelSAPCollideFunction* collide;
  /* The bits, the body or the enabled state may change of this geom and of those of this body, each
   * of which may be null; of any geom if both are. Stand-ins look at no others for that. */
  void (*changed)(dGeomID geom, dBodyID body);
  /* Contacts are not known any more: the program has colliders of its own. */
  void (*stop_contacts)(void);
} dParallelSAPStandIns;

ODE_PARALLEL_SAP_API const dParallelSAPStandIns* dParallelSAPGetStandIns(void);

#ifdef __cplusplus
}
#endif
