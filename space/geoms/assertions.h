// Assertions that name the function of the public header that the program called.
#pragma once

#include <ode/ode.h>

namespace ode_parallel_sap {

// As ODE's dUASSERT, for code that other functions call.
inline void require(bool holds, const char* message, const char* function) {
  if (!holds) dDebug(d_ERR_UASSERT, "%s in %s()", message, function);
}

}  // namespace ode_parallel_sap
