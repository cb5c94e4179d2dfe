// In the place of CUB's.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "tests/gpu/emulation/runtime.h"

namespace cub {

struct DeviceSelect {
  template <class In, class Flags, class Out, class Number>
  static cudaError_t Flagged(void* scratch, std::size_t& bytes, In in, Flags flags, Out out,
                             Number number, std::int64_t count, cudaStream_t stream) {
    const std::size_t needed = 1 + static_cast<std::size_t>(count) / 16;
    return emulation::launchWithScratch(scratch, bytes, needed, stream, [=] {
      std::uint32_t selected = 0;
      for (std::int64_t i = 0; i < count; ++i)
        if (flags[i]) out[selected++] = in[i];
      *number = selected;
    });
  }
};

}  // namespace cub
