// ODE's private header of heightfields, for the files that may include ode_private.h.
#ifndef ODE_PARALLEL_SAP_ODE_HEIGHTFIELD_H
#define ODE_PARALLEL_SAP_ODE_HEIGHTFIELD_H

#include "space/geom/ode_private.h"
//
#include "heightfield.h"

#endif
