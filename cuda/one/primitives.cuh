// Small device functions that several stages use.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

#include "cuda/device/launch.cuh"
#include "cuda/one/cells.h"
#include "cuda/one/elements.h"
#include "cuda/one/scene_plan.h"

namespace ode_parallel_sap {
namespace device {

constexpr unsigned all_lanes = 0xffffffff;

// Many records, lower and upper halves apart: a warp that reads 32 in a row reads half the lines.
struct Records {
  float4 *low, *high;

  __device__ Record operator[](std::size_t i) const { return {low[i], high[i]}; }
  __device__ void put(std::size_t i, const Record& record) const {
    low[i] = record.low;
    high[i] = record.high;
  }
};
// Those from the begin-th on in memory that holds `count`.
inline Records recordsIn(void* memory, std::size_t count, std::size_t begin = 0) {
  float4* const low = static_cast<float4*>(memory);
  return {low + begin, low + count + begin};
}
struct Levels {
  Records at[most_levels];

  explicit Levels(const CellStore& cells) {
    for (int level = 0; level < most_levels; ++level)
      at[level] = recordsIn(cells.tree, cells.layout.records, cells.layout.begin[level]);
  }
};

// Calls one of CUB's functions as work(scratch, bytes): first for the bytes that it needs.
template <class Work>
void withScratch(const ScratchQueue& queue, Work work) {
  std::size_t bytes = 0;
  work(nullptr, bytes);
  queue.scratch.reserve(bytes);
  work(queue.scratch.data(), bytes);
}

// Of all lanes of the warp.
__device__ inline int warpMin(int value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_min_sync(all_lanes, value);
#else
  for (int step = 16; step; step /= 2) value = min(value, __shfl_xor_sync(all_lanes, value, step));
  return value;
#endif
}
__device__ inline int warpMax(int value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_max_sync(all_lanes, value);
#else
  for (int step = 16; step; step /= 2) value = max(value, __shfl_xor_sync(all_lanes, value, step));
  return value;
#endif
}
__device__ inline std::uint32_t warpSum(std::uint32_t value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_add_sync(all_lanes, value);
#else
  for (int step = 16; step; step /= 2) value += __shfl_xor_sync(all_lanes, value, step);
  return value;
#endif
}

// The bounds of the records of those lanes that are `used`; in all lanes.
__device__ inline Record warpBounds(const Record& own, bool used) {
  const int least = ordered(-INFINITY), greatest = ordered(INFINITY);
  Record bounds;
  bounds.low.x = unordered(warpMin(used ? ordered(own.low.x) : greatest));
  bounds.low.y = unordered(warpMin(used ? ordered(own.low.y) : greatest));
  bounds.low.z = unordered(warpMin(used ? ordered(own.low.z) : greatest));
  bounds.high.x = unordered(warpMax(used ? ordered(own.high.x) : least));
  bounds.high.y = unordered(warpMax(used ? ordered(own.high.y) : least));
  bounds.high.z = unordered(warpMax(used ? ordered(own.high.z) : least));
  bounds.low.w = bounds.high.w = 0;
  return bounds;
}

// Box `i` of an array of 24-byte boxes: three aligned 8-byte loads.
__device__ inline Record loadBox(const float* boxes, std::size_t i) {
  const float2* const at = reinterpret_cast<const float2*>(boxes) + 3 * i;
  const float2 a = at[0], b = at[1], c = at[2];
  return {{a.x, a.y, b.x, 0}, {b.y, c.x, c.y, 0}};
}

}  // namespace device
}  // namespace ode_parallel_sap
