#include "device_backend.h"

#include <ode/ode.h>

#if ODE_PARALLEL_SAP_HAS_CUDA
#include "../cuda/cuda_sweep.h"
#endif

namespace ode_parallel_sap {

#if ODE_PARALLEL_SAP_HAS_CUDA

struct DeviceBackend::Finder {
  std::unique_ptr<CudaPairFinder> sweep = makeCudaSweep();
};

bool deviceAvailable() {
  return cudaAvailable();
}

bool DeviceBackend::find(const BoxSet& boxes, int threads, PairList& pairs) {
  if (failed_) return false;
  try {
    if (!finder_) finder_ = std::make_unique<Finder>();
    if (!finder_->sweep->takes(boxes)) return false;
    finder_->sweep->find(boxes, threads, pairs);
    return true;
  } catch (const DeviceFailure& failure) {
    dMessage(0, "parallel SAP space: the GPU failed (%s), pairs are found on the CPU from now on",
             failure.what());
    failed_ = true;
    finder_.reset();
    pairs.clear(1);
    return false;
  }
}

std::size_t DeviceBackend::bytes() const {
  return finder_ ? finder_->sweep->bytes() : 0;
}

#else

struct DeviceBackend::Finder {};

bool deviceAvailable() {
  return false;
}
bool DeviceBackend::find(const BoxSet&, int, PairList&) {
  return false;
}
std::size_t DeviceBackend::bytes() const {
  return 0;
}

#endif

DeviceBackend::DeviceBackend() = default;
DeviceBackend::~DeviceBackend() = default;

}  // namespace ode_parallel_sap
