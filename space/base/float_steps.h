// Floats as integers of the same order, and the bits of doubles. For the host and, of floats, for
// kernels.
#pragma once

#include <string.h>

#include <cstdint>

#include "space/base/both_sides.h"

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

}  // namespace ode_parallel_sap
