// What kernels do with one bound, one box or one pair. Compiled for the host too, for emulated
// devices.
#pragma once

#include <math.h>

#include "cuda/one/scene_plan.h"
#include "cuda/one/size_rules.h"
#include "space/base/both_sides.h"

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

ODE_PARALLEL_SAP_BOTH_SIDES inline float centreOf(float low, float high) {
  return 0.5f * low + 0.5f * high;
}

// Closed intervals; false for NaN. Holds for inverted boxes and for bounds of them.
ODE_PARALLEL_SAP_BOTH_SIDES inline bool overlap(const float4& low_a, const float4& high_a,
                                                const float4& low_b, const float4& high_b) {
  return (low_a.x <= high_b.x) & (low_b.x <= high_a.x) & (low_a.y <= high_b.y) &
         (low_b.y <= high_a.y) & (low_a.z <= high_b.z) & (low_b.z <= high_a.z);
}

// The bounds of a box in nine bits each, for a test that takes few instructions: an interval in
// each ten bits of a word, the topmost of which is set in `high`.
struct CoarseBox {
  std::uint32_t low, high;
};
// fixed: above each nine bits.
constexpr std::uint32_t coarse_guards = 1u << 9 | 1u << 19 | 1u << 29;

// Whether the boxes may overlap: certainly, where overlap() says so.
ODE_PARALLEL_SAP_BOTH_SIDES inline bool mayOverlap(const CoarseBox& a, const CoarseBox& b) {
  // A guard stays where it is unless the lower bound is above the upper one.
  return ((a.high - b.low) & (b.high - a.low) & coarse_guards) == coarse_guards;
}

// From floats to nine bits, so that a greater one never becomes the smaller: whatever the bounds
// are by which it is made, infinite ones included. It tells most between these.
struct CoarseScale {
  float origin[3], scale[3];

  CoarseScale() = default;
  ODE_PARALLEL_SAP_BOTH_SIDES CoarseScale(const float4& low, const float4& high)
      : origin{low.x, low.y, low.z},
        scale{scaleOf(low.x, high.x), scaleOf(low.y, high.y), scaleOf(low.z, high.z)} {}

  // Of bounds that are no NaN.
  ODE_PARALLEL_SAP_BOTH_SIDES CoarseBox coarse(const float4& low, const float4& high) const {
    return {
        stepOf(low.x, 0) + (stepOf(low.y, 1) << 10) + (stepOf(low.z, 2) << 20),
        stepOf(high.x, 0) + (stepOf(high.y, 1) << 10) + (stepOf(high.z, 2) << 20) + coarse_guards};
  }

 private:
  ODE_PARALLEL_SAP_BOTH_SIDES static float scaleOf(float low, float high) {
    return high > low ? 1 / (high - low) : 0;
  }
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t stepOf(float value, int axis) const {
    // What is no number, of infinite bounds or factors, becomes 0: fmaxf takes the other one.
    const float part = fminf(fmaxf((value - origin[axis]) * scale[axis], 0.0f), 1.0f);
    return static_cast<std::uint32_t>(part * 511.0f);
  }
};

// The same for boxes without NaN: by how much they overlap on the axis where it is least; below 0
// if they do not. At 0 only the exact boxes can tell.
ODE_PARALLEL_SAP_BOTH_SIDES inline float depthOf(const float4& low_a, const float4& high_a,
                                                 const float4& low_b, const float4& high_b) {
  const float x = fminf(high_b.x - low_a.x, high_a.x - low_b.x);
  const float y = fminf(high_b.y - low_a.y, high_a.y - low_b.y);
  const float z = fminf(high_b.z - low_a.z, high_a.z - low_b.z);
  return fminf(x, fminf(y, z));
}

ODE_PARALLEL_SAP_BOTH_SIDES inline bool isActive(const Record& box) {
  return box.low.x == box.low.x && box.low.y == box.low.y && box.low.z == box.low.z &&
         box.high.x == box.high.x && box.high.y == box.high.y && box.high.z == box.high.z;
}

// The bin of its sizes.
ODE_PARALLEL_SAP_BOTH_SIDES inline int binOf(const Record& box) {
  return binOf(box.high.x - box.low.x, box.high.y - box.low.y, box.high.z - box.low.z);
}

}  // namespace device
}  // namespace ode_parallel_sap
