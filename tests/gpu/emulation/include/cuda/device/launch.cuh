// In the place of the file of this name in cuda/: kernels become work of the emulated streams.
#pragma once

#include <cstddef>
#include <tuple>

#include "cuda/device/device.h"
#include "cuda/device/grid.h"
#include "tests/gpu/emulation/block.h"
#include "tests/gpu/emulation/runtime.h"

namespace ode_parallel_sap {
namespace device {

template <class... Parameters, class... Arguments>
void launch(const char* name, void (*kernel)(Parameters...), std::size_t blocks, int threads,
            cudaStream_t stream, Arguments... arguments) {
  const std::tuple<Parameters...> all(static_cast<Parameters>(arguments)...);
  const auto run = [=] { emulation::runBlocks(blocks, threads, [&] { std::apply(kernel, all); }); };
  checkCuda(cudaCallIsToFail() ? cudaErrorLaunchFailure
            : blocks == 0      ? cudaErrorInvalidConfiguration
                               : emulation::launch(stream, run),
            name);
}

}  // namespace device
}  // namespace ode_parallel_sap
