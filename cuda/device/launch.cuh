// Starts kernels.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>

#include "cuda/device/device.h"
#include "cuda/device/grid.h"

namespace ode_parallel_sap {
namespace device {

// Starts a kernel on `stream` and checks that it started.
template <class... Parameters, class... Arguments>
void launch(const char* name, void (*kernel)(Parameters...), std::size_t blocks, int threads,
            cudaStream_t stream, Arguments... arguments) {
  cudaLaunchConfig_t config = {};
  config.gridDim = dim3(static_cast<unsigned>(blocks));
  config.blockDim = dim3(threads);
  config.stream = stream;
  checkCuda(cudaCallIsToFail() ? cudaErrorLaunchFailure
                               : cudaLaunchKernelEx(&config, kernel, Parameters(arguments)...),
            name);
}

}  // namespace device
}  // namespace ode_parallel_sap
