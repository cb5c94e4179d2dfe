// A pair that is to be collided.
#ifndef ODE_PARALLEL_SAP_GEOM_PAIR_H
#define ODE_PARALLEL_SAP_GEOM_PAIR_H

#include <ode/ode.h>

namespace ode_parallel_sap {

struct GeomPair {
  dGeomID o1, o2;
};

}  // namespace ode_parallel_sap

#endif
