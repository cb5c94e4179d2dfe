// What nvcc adds to C++ and kernels use, for a compiler that knows nothing of it. Included ahead of
// each of them.
#pragma once

#include <cuda_runtime.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "tests/gpu/emulation/block.h"

#undef __shared__
#define __shared__ static  // one block runs at a time
#undef __launch_bounds__
#define __launch_bounds__(...)
#undef __global__
#define __global__
#undef __device__
#define __device__

#define threadIdx (emulation::threadIndex())
#define blockIdx (emulation::blockIndex())
#define gridDim (emulation::gridSize())

namespace emulation {

template <class To, class From>
To bitsOf(From value) {
  To bits = {};
  std::memcpy(&bits, &value, std::min(sizeof bits, sizeof value));
  return bits;
}

template <class Value>
Value valueOf(Value own, int of_lane) {
  return bitsOf<Value>(exchange(bitsOf<std::uint64_t>(own))[of_lane % warp_lanes]);
}

}  // namespace emulation

inline void __syncthreads() {
  emulation::waitForBlock();
}
inline int __syncthreads_or(int own) {
  return emulation::anyOfBlock(own != 0);
}
inline void __syncwarp(unsigned = ~0u) {
  emulation::exchange(0);
}

template <class Value>
Value __shfl_sync(unsigned, Value own, int lane) {
  return emulation::valueOf(own, lane);
}
template <class Value>
Value __shfl_up_sync(unsigned, Value own, int by) {
  const int lane = emulation::lane();
  return emulation::valueOf(own, lane < by ? lane : lane - by);
}
template <class Value>
Value __shfl_xor_sync(unsigned, Value own, int mask) {
  return emulation::valueOf(own, emulation::lane() ^ mask);
}
inline unsigned __ballot_sync(unsigned, bool own) {
  unsigned lanes = 0;
  const emulation::LaneValues& all = emulation::exchange(own);
  for (int i = 0; i < emulation::warp_lanes; ++i)
    if (all[i]) lanes |= 1u << i;
  return lanes;
}
inline int __any_sync(unsigned lanes, bool own) {
  return __ballot_sync(lanes, own) != 0;
}
inline int __all_sync(unsigned lanes, bool own) {
  return __ballot_sync(lanes, own) == ~0u;
}

inline int __popc(unsigned value) {
  return __builtin_popcount(value);
}
inline int __clz(int value) {
  return value ? __builtin_clz(value) : 32;
}
inline int __clzll(long long value) {
  return value ? __builtin_clzll(value) : 64;
}
inline int __ffs(int value) {
  return __builtin_ffs(value);
}
inline float __uint_as_float(unsigned value) {
  return emulation::bitsOf<float>(value);
}
inline unsigned __float_as_uint(float value) {
  return emulation::bitsOf<unsigned>(value);
}

template <class Value, class Other>
Value atomicAdd(Value* at, Other value) {
  return std::exchange(*at, *at + static_cast<Value>(value));
}
template <class Value, class Other>
Value atomicSub(Value* at, Other value) {
  return std::exchange(*at, *at - static_cast<Value>(value));
}
template <class Value>
Value atomicMin(Value* at, Value value) {
  return std::exchange(*at, std::min(*at, value));
}
template <class Value>
Value atomicMax(Value* at, Value value) {
  return std::exchange(*at, std::max(*at, value));
}

template <class A, class B>
std::common_type_t<A, B> min(A a, B b) {
  return std::min<std::common_type_t<A, B>>(b, a);
}
template <class A, class B>
std::common_type_t<A, B> max(A a, B b) {
  return std::max<std::common_type_t<A, B>>(a, b);
}
