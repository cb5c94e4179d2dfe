// In the place of CUB's. The result is in either buffer, by the number of
// passes over eight digits that there would be; the other one holds anything afterwards.
#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "tests/gpu/emulation/runtime.h"

namespace cub {

template <class Value>
struct DoubleBuffer {
  Value* buffers[2];
  int selector = 0;
  DoubleBuffer(Value* current, Value* other) : buffers{current, other} {}
  Value* Current() { return buffers[selector]; }
  Value* Alternate() { return buffers[selector ^ 1]; }
};

struct DeviceRadixSort {
  template <class Key, class Value>
  static cudaError_t SortPairs(void* scratch, std::size_t& bytes, DoubleBuffer<Key>& keys,
                               DoubleBuffer<Value>& values, std::int64_t count, int begin, int end,
                               cudaStream_t stream) {
    const auto sort = [=]() mutable {
      const std::vector<std::size_t> order = orderOf(keys.Current(), count, begin, end);
      const bool moves = changesBuffer(begin, end);
      place(keys, order, moves);
      place(values, order, moves);
    };
    if (scratch && changesBuffer(begin, end)) {
      keys.selector ^= 1;
      values.selector ^= 1;
    }
    return emulation::pushWithScratch(scratch, bytes, scratchFor(count), stream, sort);
  }
  template <class Key>
  static cudaError_t SortKeys(void* scratch, std::size_t& bytes, DoubleBuffer<Key>& keys,
                              std::int64_t count, int begin, int end, cudaStream_t stream) {
    const auto sort = [=]() mutable {
      place(keys, orderOf(keys.Current(), count, begin, end), changesBuffer(begin, end));
    };
    if (scratch && changesBuffer(begin, end)) keys.selector ^= 1;
    return emulation::pushWithScratch(scratch, bytes, scratchFor(count), stream, sort);
  }

 private:
  static std::size_t scratchFor(std::int64_t count) {
    return 1 + static_cast<std::size_t>(count) / 4;
  }
  static bool changesBuffer(int begin, int end) { return (end - begin + 7) / 8 % 2 == 1; }
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
  static void place(DoubleBuffer<Value> buffer, const std::vector<std::size_t>& order, bool moves) {
    Value* const current = buffer.Current();
    std::vector<Value> sorted;
    for (const std::size_t i : order) sorted.push_back(current[i]);
    Value* const to = moves ? buffer.Alternate() : current;
    std::fill_n(moves ? current : buffer.Alternate(), order.size(), static_cast<Value>(0x77));
    std::copy(sorted.begin(), sorted.end(), to);
  }
};

}  // namespace cub
