// What a user may set on a space, and the environment that stands in where nothing is set.
#ifndef ODE_PARALLEL_SAP_SETTINGS_H
#define ODE_PARALLEL_SAP_SETTINGS_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include "space/geom/pack_rules.h"

#include <cstdint>

namespace ode_parallel_sap {

constexpr int most_threads = 256;

struct Settings {
  int backend = dParallelSAPBackendAuto;
  int method = dParallelSAPMethodAuto;
  int threads = 0;  // 0: what OpenMP would use
  int devices = 0;  // 0: chosen by the space
  bool print_stats = false;
  PackRules rules;
  std::uint64_t axis_lists_bytes = 0;  // the most the method AxisLists may take; 0: its own choice
};

// Whether this build on this machine has it. Auto is always to be had.
bool hasBackend(int backend);
bool hasMethod(int method);

// The defaults as changed by ODE_PARALLEL_SAP_*, of which ODE_PARALLEL_SAP_SIMD takes effect at
// once; complaints go to dMessage.
Settings settingsFromEnvironment();

const char* backendName(int backend);
const char* methodName(int method);

// The threads a collide may use: 1 to most_threads.
int threadsFor(const Settings& settings);

}  // namespace ode_parallel_sap

#endif
