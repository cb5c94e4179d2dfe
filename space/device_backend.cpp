#include "device_backend.h"

#include <ode/ode.h>

#include <algorithm>
#include <numeric>
#include <vector>

#if ODE_PARALLEL_SAP_HAS_CUDA
#include "../cuda/cuda_axis_lists.h"
#include "../cuda/cuda_sweep.h"
#endif

namespace ode_parallel_sap {

#if ODE_PARALLEL_SAP_HAS_CUDA

struct DeviceBackend::Finder {
  std::unique_ptr<CudaPairFinder> sweep = makeCudaSweep();
  std::unique_ptr<CudaAxisListsFinder> axis_lists;
};

bool deviceAvailable() {
  return cudaAvailable();
}

bool DeviceBackend::find(const BoxSet& boxes, int threads, PairList& pairs) {
  return attempt(pairs, [&] {
    if (!finder_->sweep->takes(boxes)) return false;
    finder_->sweep->find(boxes, threads, pairs);
    devices_ = 1;
    return true;
  });
}

bool DeviceBackend::findByAxisLists(const BoxSet& boxes, int threads, int devices,
                                    std::uint64_t most_bytes, PairList& pairs) {
  return attempt(pairs, [&] {
    if (!finder_->axis_lists) finder_->axis_lists = makeCudaAxisLists();
    CudaAxisListsFinder& lists = *finder_->axis_lists;
    devices_ = devices > 1 ? std::max(1, std::min(devices, cudaDevices())) : 1;
    std::vector<int> numbers(devices_);
    std::iota(numbers.begin(), numbers.end(), 0);
    lists.useDevices(numbers);
    lists.limit(most_bytes);
    lists.find(boxes, threads, pairs);
    return true;
  });
}

// Does the work unless a device failed before. Where one fails now, that is the last time.
template <class Work>
bool DeviceBackend::attempt(PairList& pairs, Work work) {
  if (failed_) return false;
  try {
    if (!finder_) finder_ = std::make_unique<Finder>();
    return work();
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
  if (!finder_) return 0;
  return finder_->sweep->bytes() + (finder_->axis_lists ? finder_->axis_lists->bytes() : 0);
}

#else

struct DeviceBackend::Finder {};

bool deviceAvailable() {
  return false;
}
bool DeviceBackend::find(const BoxSet&, int, PairList&) {
  return false;
}
bool DeviceBackend::findByAxisLists(const BoxSet&, int, int, std::uint64_t, PairList&) {
  return false;
}
std::size_t DeviceBackend::bytes() const {
  return 0;
}

#endif

DeviceBackend::DeviceBackend() = default;
DeviceBackend::~DeviceBackend() = default;

}  // namespace ode_parallel_sap
