// ODE's private headers, which define dxGeom, dxSpace and the simple classes. Only the files listed
// in sources_on_ode_internals (CMakeLists.txt) may include this.
#pragma once

#include <ode/ode.h>

#include "config.h"
//
#include "collision_kernel.h"
#include "collision_std.h"
#include "error.h"
#include "heightfield.h"

#if !defined(CHECK_NOT_LOCKED)  // forks have it there
#include "collision_space_internal.h"
#endif

// Words of Windows' headers, which ODE's include.
#undef far
#undef near
