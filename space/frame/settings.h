// What a user may set on a space.
#pragma once

#include <omp.h>

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>

#include "space/base/team.h"
#include "space/geoms/pack_rules.h"

namespace ode_parallel_sap {

struct Settings {
  int backend = dParallelSAPBackendAuto;
  int method = dParallelSAPMethodAuto;
  int threads = 0;  // 0: what OpenMP would use
  int devices = 0;  // 0: chosen by the space
  bool print_stats = false;
  PackRules rules;
};

// The threads a collide may use: 1 to most_threads.
inline int threadsFor(const Settings& settings) {
  if (teamsAreLost()) return 1;
  return std::max(
      1, std::min(settings.threads ? settings.threads : omp_get_max_threads(), most_threads));
}

}  // namespace ode_parallel_sap
