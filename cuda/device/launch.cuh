// Starts kernels.
#ifndef ODE_PARALLEL_SAP_CUDA_LAUNCH_CUH
#define ODE_PARALLEL_SAP_CUDA_LAUNCH_CUH

#include <cuda_runtime.h>

#include <cstddef>

#include "cuda/device/device.h"

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

inline std::size_t blocksFor(std::size_t items, std::size_t items_a_block, std::size_t most) {
  const std::size_t blocks = (items + items_a_block - 1) / items_a_block;
  return blocks < 1 ? 1 : blocks < most ? blocks : most;
}

}  // namespace device
}  // namespace ode_parallel_sap

#endif
