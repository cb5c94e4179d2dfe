// Where two geoms first touch on their way through a step.
#pragma once

#include <ode/ode.h>

struct dxGeom;

namespace ode_parallel_sap {

// As the header says of dParallelSAPCollideSwept.
int collideSwept(dxGeom* a, dxGeom* b, dReal step, int flags, dContactGeom* contacts, int skip);

}  // namespace ode_parallel_sap
