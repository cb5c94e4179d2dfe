#include "space/finders/device_backend.h"

#include <utility>

#include <ode/ode.h>

#if ODE_PARALLEL_SAP_HAS_CUDA
#include <algorithm>
#include <string>
#include <vector>

#include "cuda/axis_lists/cuda_axis_lists.h"
#include "cuda/finder/cuda_sweep.h"
#include "cuda/finder/device_pool.h"
#endif

namespace ode_parallel_sap {

DeviceBackend::DeviceBackend() = default;
DeviceBackend::~DeviceBackend() = default;

#if ODE_PARALLEL_SAP_HAS_CUDA

struct DeviceBackend::Finder {
  std::unique_ptr<CudaPairFinder> sweep =
      makeCudaSweep([](std::size_t i) { return DevicePool::get().device(i); });
  std::unique_ptr<CudaAxisListsFinder> axis_lists;
};

bool deviceAvailable() {
  return DevicePool::get().count() > 0;
}

int DeviceBackend::lost() const {
  return finder_ ? finder_->sweep->devicesLost() : 0;
}

DeviceBackend::Devices DeviceBackend::devices() const {
  if (failed_) return {};
  const DevicePool& pool = DevicePool::get();
  return {true, pool.ready() - lost(), pool.countSoFar() - lost()};
}

void DeviceBackend::prepare(int devices) {
  DevicePool& pool = DevicePool::get();
  pool.prepare(std::min(devices + lost(), pool.countSoFar()));
}

// Tells of devices that were left out, whichever space met them first, and of those that failed
// this space. `reason`: why the space has none any more, where nothing else says so.
void DeviceBackend::reportFailures(const std::string& reason) {
  const std::vector<FailedDevice> left_out = DevicePool::get().takeFailures();
  std::vector<FailedDevice> failed;
  if (finder_) failed = finder_->sweep->takeFailures();
  if (left_out.empty() && failed.empty() && !failed_) return;
  const int left = failed_ ? 0 : DevicePool::get().countSoFar() - lost();
  loss_ = true;
  const std::string then = left > 0 ? "; GPUs left: " + std::to_string(left)
                                    : ", pairs are found on the CPU from now on";
  for (const FailedDevice& device : left_out)
    dMessage(0, "parallel SAP space: GPU %d cannot be used (%s)%s", device.device,
             device.reason.c_str(), then.c_str());
  for (const FailedDevice& device : failed)
    dMessage(0, "parallel SAP space: GPU %d failed (%s)%s", device.device, device.reason.c_str(),
             then.c_str());
  if (left_out.empty() && failed.empty())
    dMessage(0, "parallel SAP space: the GPU back end failed (%s)%s", reason.c_str(), then.c_str());
}

// Does the work unless all devices failed before. Where the last one fails now, that was the last
// time.
template <class Work>
int DeviceBackend::attempt(PairList& pairs, Work work) {
  if (failed_) return 0;
  if (!finder_) finder_ = std::make_unique<Finder>();
  int used = 0;
  std::string reason;
  try {
    used = work();
  } catch (const DeviceFailure& failure) {
    reason = failure.what();
    failed_ = true;
    pairs.clear(1);
  }
  reportFailures(reason);
  if (failed_) finder_.reset();
  return used;
}

int DeviceBackend::find(const BoxSet& boxes, int threads, int devices, PairList& pairs) {
  return attempt(pairs, [&] {
    CudaPairFinder& sweep = *finder_->sweep;
    if (!sweep.takes(boxes)) return 0;
    sweep.useDevices(devices);
    sweep.find(boxes, threads, pairs);
    return sweep.devicesUsed();
  });
}

int DeviceBackend::findByAxisLists(const BoxSet& boxes, int threads, int devices,
                                   std::uint64_t most_bytes, PairList& pairs) {
  return attempt(pairs, [&] {
    if (!finder_->axis_lists) finder_->axis_lists = makeCudaAxisLists();
    CudaAxisListsFinder& lists = *finder_->axis_lists;
    std::vector<int> used;
    for (int device; static_cast<int>(used.size()) < devices; used.push_back(device)) {
      device = DevicePool::get().device(used.size());
      if (device < 0) break;
    }
    if (used.empty()) throw DeviceFailure("no device is left");
    lists.useDevices(used);
    lists.limit(most_bytes);
    lists.find(boxes, threads, pairs);
    return static_cast<int>(used.size());
  });
}

void DeviceBackend::reportLeftOut() {
  if (!failed_ && DevicePool::get().hasFailures()) reportFailures({});
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
DeviceBackend::Devices DeviceBackend::devices() const {
  return {};
}
void DeviceBackend::prepare(int) {}
int DeviceBackend::find(const BoxSet&, int, int, PairList&) {
  return 0;
}
int DeviceBackend::findByAxisLists(const BoxSet&, int, int, std::uint64_t, PairList&) {
  return 0;
}
void DeviceBackend::reportLeftOut() {}
std::size_t DeviceBackend::bytes() const {
  return 0;
}

#endif

bool DeviceBackend::takeLoss() {
  return std::exchange(loss_, false);
}

}  // namespace ode_parallel_sap
