// The environment that stands in where a program sets nothing.
#pragma once

#include <memory>

#include "space/frame/settings.h"
#include "space/trace/trace.h"

namespace ode_parallel_sap {

// Whether the number is one of the header's.
bool isBackend(int number);
bool isMethod(int number);
// Whether this build on this machine has it. All methods are to be had.
bool hasBackend(int backend);

// The defaults as changed by ODE_PARALLEL_SAP_*, of which ODE_PARALLEL_SAP_SIMD takes effect at
// once; complaints go to dMessage.
Settings settingsFromEnvironment();

// ODE_PARALLEL_SAP_CONTACTS, for spaces under the preload library, which answers dCollide.
Precompute precomputeFromEnvironment();

// Whether spaces under the preload library rely on being told what it intercepts; by
// ODE_PARALLEL_SAP_NOTIFIED.
bool standInsAreTold();

// What ODE_PARALLEL_SAP_TRACE asks for; null if nothing.
std::unique_ptr<Trace> traceFromEnvironment();

}  // namespace ode_parallel_sap
