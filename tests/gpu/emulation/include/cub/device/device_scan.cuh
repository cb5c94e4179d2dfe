// In the place of CUB's.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "tests/gpu/emulation/runtime.h"

namespace cub {

struct DeviceScan {
  template <class In, class Out, class Join, class Value>
  static cudaError_t ExclusiveScan(void* scratch, std::size_t& bytes, In in, Out out, Join join,
                                   Value first, std::int64_t count, cudaStream_t stream) {
    const std::size_t needed = 1 + static_cast<std::size_t>(count) / 8;
    return emulation::launchWithScratch(scratch, bytes, needed, stream, [=] {
      Value sum = first;
      for (std::int64_t i = 0; i < count; ++i) {
        const Value value = static_cast<Value>(in[i]);
        out[i] = sum;
        sum = join(sum, value);
      }
    });
  }
};

}  // namespace cub
