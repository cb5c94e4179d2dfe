// Whether the ODE in this process is laid out as the private headers say.
#pragma once

namespace ode_parallel_sap {

// Null, or the first expectation that does not hold: what the library writes through the public API
// is read back through the private layout. The build has made the same check of the ODE it found,
// in more detail (cmake/check_ode.cpp); this is for one that was put in its place since.
const char* misfitOfODE();

}  // namespace ode_parallel_sap
