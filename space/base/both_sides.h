// Functions that kernels and host code share: bits and the order of floats, extents.
#pragma once

#include <string.h>

#include <cstdint>

#if defined(__CUDACC__)
#define ODE_PARALLEL_SAP_BOTH_SIDES __host__ __device__
#else
#define ODE_PARALLEL_SAP_BOTH_SIDES
#endif

namespace ode_parallel_sap {

ODE_PARALLEL_SAP_BOTH_SIDES inline std::int32_t bitsOf(float value) {
  std::int32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}
inline std::uint64_t bitsOf(double value) {
  std::uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}
ODE_PARALLEL_SAP_BOTH_SIDES inline float floatOf(std::int32_t bits) {
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

// Maps floats to integers of the same order, and back. -0 comes before +0; NaN beyond infinity.
ODE_PARALLEL_SAP_BOTH_SIDES inline std::int32_t ordered(float value) {
  const std::int32_t bits = bitsOf(value);
  return bits ^ ((bits >> 31) & 0x7fffffff);
}
ODE_PARALLEL_SAP_BOTH_SIDES inline float unordered(std::int32_t order) {
  return floatOf(order ^ ((order >> 31) & 0x7fffffff));
}

// Ranges of centres are measured by the boxes' extents on the axis. Extents of nothing are taken as
// a small part of the greatest, or as all the same.
ODE_PARALLEL_SAP_BOTH_SIDES inline double extentToMeasureBy(double extent, double greatest) {
  constexpr double thinnest = 1.0 / 1024;  // fixed: any small part
  if (!(greatest > 0)) return 1;
  return extent < greatest * thinnest ? greatest * thinnest : extent;
}

}  // namespace ode_parallel_sap
