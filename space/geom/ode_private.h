// ODE's private headers, which define dxGeom, dxSpace and the simple classes. Only the files listed
// in sources_on_ode_internals (CMakeLists.txt) may include this.
#ifndef ODE_PARALLEL_SAP_ODE_PRIVATE_H
#define ODE_PARALLEL_SAP_ODE_PRIVATE_H

#include <ode/ode.h>

#include "config.h"
//
#include "collision_kernel.h"
#include "collision_std.h"
#include "error.h"

#endif
