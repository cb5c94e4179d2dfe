// What ranges of centres are measured by. For kernels and host.
#pragma once

#include "space/base/both_sides.h"

namespace ode_parallel_sap {

// The boxes' extents on the axis. Extents of nothing are taken as a small part of the greatest, or
// as all the same.
ODE_PARALLEL_SAP_BOTH_SIDES inline double extentToMeasureBy(double extent, double greatest) {
  constexpr double thinnest = 1.0 / 1024;  // fixed: any small part
  if (!(greatest > 0)) return 1;
  return extent < greatest * thinnest ? greatest * thinnest : extent;
}

}  // namespace ode_parallel_sap
