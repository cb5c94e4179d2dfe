// In the place of CUB's, as far as kernels' hosts call it: of all three headers.
#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "tests/gpu/emulation/runtime.h"

namespace cub {

using emulation::launchWithScratch;

struct DeviceRadixSort {
  template <class Key, class Value>
  static cudaError_t SortPairs(void* scratch, std::size_t& bytes, const Key* keys, Key* sorted_keys,
                               const Value* values, Value* sorted_values, std::int64_t count,
                               int begin, int end, cudaStream_t stream) {
    return launchWithScratch(scratch, bytes, count / 4, stream, [=] {
      const std::vector<std::size_t> order = orderOf(keys, count, begin, end);
      place(keys, sorted_keys, order);
      place(values, sorted_values, order);
    });
  }
  template <class Key>
  static cudaError_t SortKeys(void* scratch, std::size_t& bytes, const Key* keys, Key* sorted,
                              std::int64_t count, int begin, int end, cudaStream_t stream) {
    return launchWithScratch(scratch, bytes, count / 4, stream,
                             [=] { place(keys, sorted, orderOf(keys, count, begin, end)); });
  }

 private:
  // By digits [begin, end) of the keys.
  template <class Key>
  static std::vector<std::size_t> orderOf(const Key* keys, std::int64_t count, int begin, int end) {
    Key digits = 0;
    for (int i = begin; i < end; ++i) digits |= Key{1} << i;
    std::vector<std::size_t> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return (keys[a] & digits) < (keys[b] & digits);
    });
    return order;
  }
  template <class Value>
  static void place(const Value* from, Value* to, const std::vector<std::size_t>& order) {
    for (const std::size_t i : order) *to++ = from[i];
  }
};

struct DeviceScan {
  template <class In, class Out, class Join, class Value>
  static cudaError_t ExclusiveScan(void* scratch, std::size_t& bytes, In in, Out out, Join join,
                                   Value first, std::int64_t count, cudaStream_t stream) {
    return launchWithScratch(scratch, bytes, count / 8, stream, [=] {
      Value sum = first;
      for (std::int64_t i = 0; i < count; ++i) {
        const Value value = static_cast<Value>(in[i]);
        out[i] = sum;
        sum = join(sum, value);
      }
    });
  }
};

struct DeviceSelect {
  template <class In, class Flags, class Out, class Number>
  static cudaError_t Flagged(void* scratch, std::size_t& bytes, In in, Flags flags, Out out,
                             Number number, std::int64_t count, cudaStream_t stream) {
    return launchWithScratch(scratch, bytes, count / 16, stream, [=] {
      std::uint32_t selected = 0;
      for (std::int64_t i = 0; i < count; ++i)
        if (flags[i]) out[selected++] = in[i];
      *number = selected;
    });
  }
};

}  // namespace cub
