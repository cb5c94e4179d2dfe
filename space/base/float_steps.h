// Floats as integers of the same order, and doubles. For the host and, of floats, for kernels.
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

// Numbers the floats by steps, the two zeros being one.
ODE_PARALLEL_SAP_BOTH_SIDES inline std::int32_t stepNumber(float value) {
  const std::int32_t bits = bitsOf(value), sign = bits >> 31;
  return ((bits & 0x7fffffff) ^ sign) - sign;
}
// The same without a sign.
ODE_PARALLEL_SAP_BOTH_SIDES inline std::uint32_t unsignedStepNumber(float value) {
  return static_cast<std::uint32_t>(stepNumber(value)) ^ 0x80000000u;
}

// Whether only the exact bounds can tell that `low` is not above `high`: floats are rounded outward
// by less than one step each, and shrunk by two they would pass each other.
ODE_PARALLEL_SAP_BOTH_SIDES inline bool isBorderline(float low, float high) {
  return stepNumber(low) + 2 > stepNumber(high);
}

}  // namespace ode_parallel_sap
