// What kernels do with one bound, one box or one pair. Compiled for the host too, where it is held
// against the CPU's rules without a device (tests/elements_test).
#ifndef ODE_PARALLEL_SAP_CUDA_ELEMENTS_H
#define ODE_PARALLEL_SAP_CUDA_ELEMENTS_H

#include <math.h>

#include <cstdint>
#include <cstring>

#include "cuda/one/both_sides.h"
#include "cuda/one/scene_plan.h"

namespace ode_parallel_sap {
namespace device {

#if !defined(__CUDACC__)
// CUDA's, which only its own compiler has.
struct alignas(16) float4 {
  float x, y, z, w;
};
#endif

struct Record {
  float4 low, high;
};
static_assert(sizeof(Record) == record_bytes, "records are allocated by this size");

ODE_PARALLEL_SAP_BOTH_SIDES inline std::int32_t bitsOf(float value) {
  std::int32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}
ODE_PARALLEL_SAP_BOTH_SIDES inline float floatOf(std::int32_t bits) {
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

// Maps floats to integers of the same order, and back. -0 comes before +0; NaN beyond infinity.
ODE_PARALLEL_SAP_BOTH_SIDES inline int ordered(float value) {
  const int bits = bitsOf(value);
  return bits ^ ((bits >> 31) & 0x7fffffff);
}
ODE_PARALLEL_SAP_BOTH_SIDES inline float unordered(int order) {
  return floatOf(order ^ ((order >> 31) & 0x7fffffff));
}

// Numbers the floats by steps, as on the CPU: the two zeros are one.
ODE_PARALLEL_SAP_BOTH_SIDES inline int stepNumber(float value) {
  const int bits = bitsOf(value), sign = bits >> 31;
  return ((bits & 0x7fffffff) ^ sign) - sign;
}

ODE_PARALLEL_SAP_BOTH_SIDES inline float centreOf(float low, float high) {
  return 0.5f * low + 0.5f * high;
}

// Closed intervals; false for NaN. Holds for inverted boxes and for bounds of them.
ODE_PARALLEL_SAP_BOTH_SIDES inline bool overlap(const float4& low_a, const float4& high_a,
                                                const float4& low_b, const float4& high_b) {
  return (low_a.x <= high_b.x) & (low_b.x <= high_a.x) & (low_a.y <= high_b.y) &
         (low_b.y <= high_a.y) & (low_a.z <= high_b.z) & (low_b.z <= high_a.z);
}

// Whether only the exact boxes can tell that two overlap whose float bounds do: one bound shrunk by
// two steps would pass the other.
ODE_PARALLEL_SAP_BOTH_SIDES inline bool isBorderline(float low, float high) {
  return stepNumber(low) + 2 > stepNumber(high);
}
ODE_PARALLEL_SAP_BOTH_SIDES inline bool isUnsure(const float4& low_a, const float4& high_a,
                                                 const float4& low_b, const float4& high_b) {
  return isBorderline(low_a.x, high_b.x) | isBorderline(low_b.x, high_a.x) |
         isBorderline(low_a.y, high_b.y) | isBorderline(low_b.y, high_a.y) |
         isBorderline(low_a.z, high_b.z) | isBorderline(low_b.z, high_a.z);
}

// Whether two boxes overlap by so much more than two steps that isUnsure need not be asked. The
// size of each high.w is the greatest magnitude of its bounds: a step is at most 2^-22 of it, a
// quarter of the distance wanted, or the smallest number there is.
ODE_PARALLEL_SAP_BOTH_SIDES inline bool isClear(const float4& low_a, const float4& high_a,
                                                const float4& low_b, const float4& high_b) {
  const float x = fminf(high_b.x - low_a.x, high_a.x - low_b.x);
  const float y = fminf(high_b.y - low_a.y, high_a.y - low_b.y);
  const float z = fminf(high_b.z - low_a.z, high_a.z - low_b.z);
  const float smallest_normal = 1.17549435e-38f;
  return fminf(x, fminf(y, z)) >
         fmaf(fmaxf(fabsf(high_a.w), fabsf(high_b.w)), 1.0f / (1 << 20), smallest_normal);
}
// The sign of high.w tells guests (scene_plan.h).
ODE_PARALLEL_SAP_BOTH_SIDES inline bool isGuest(const float4& high) {
  return bitsOf(high.w) < 0;
}
ODE_PARALLEL_SAP_BOTH_SIDES inline float magnitudeOf(const float4& low, const float4& high) {
  return fmaxf(fmaxf(fmaxf(fabsf(low.x), fabsf(high.x)), fmaxf(fabsf(low.y), fabsf(high.y))),
               fmaxf(fabsf(low.z), fabsf(high.z)));
}

ODE_PARALLEL_SAP_BOTH_SIDES inline bool isActive(const Record& box) {
  return box.low.x == box.low.x && box.low.y == box.low.y && box.low.z == box.low.z &&
         box.high.x == box.high.x && box.high.y == box.high.y && box.high.z == box.high.z;
}

// Sizes and shapes as in SizeClasses on the CPU, where the numbers come from.
constexpr int class_octaves = 3;
constexpr int unbounded_octave = 255;

ODE_PARALLEL_SAP_BOTH_SIDES inline int octaveOf(float extent) {
  const int bits = bitsOf(extent);
  const bool nan = (bits & 0x7fffffff) > 0x7f800000;
  return bits < 0 && !nan ? 0 : bits >> 23 & 0xff;
}

// The octave of the greatest extent, and for each axis whether the extent there is far shorter.
ODE_PARALLEL_SAP_BOTH_SIDES inline int binOf(const Record& box) {
  const int x = octaveOf(box.high.x - box.low.x), y = octaveOf(box.high.y - box.low.y),
            z = octaveOf(box.high.z - box.low.z);
  const int greater = x > y ? x : y, greatest = greater > z ? greater : z;
  if (greatest == unbounded_octave) return unbounded_octave * shapes;
  return greatest * shapes + (greatest - x >= class_octaves) + (greatest - y >= class_octaves) * 2 +
         (greatest - z >= class_octaves) * 4;
}

}  // namespace device
}  // namespace ode_parallel_sap

#endif
