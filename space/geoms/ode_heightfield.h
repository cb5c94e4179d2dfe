// ODE's private header of heightfields, for the files that may include ode_private.h.
#pragma once

#include "space/geoms/ode_private.h"
//
#include "heightfield.h"
