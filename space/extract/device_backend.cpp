#include "space/extract/device_backend.h"

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

namespace {

BackendChoice::Candidates candidatesFor(const DeviceBackend::Wish& wish, int devices) {
  if (wish.devices == 0) return BackendChoice::Candidates::upTo(wish.processor, devices);
  return BackendChoice::Candidates::only(wish.processor, std::min(wish.devices, devices));
}

}  // namespace

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

int DeviceBackend::choose(const BoxSet& boxes, const Wish& wish) {
  if (failed_ || boxes.wide) return 0;
  const DevicePool& pool = DevicePool::get();
  // A number that is set without leave for the processor is taken as it is.
  if (!wish.processor && wish.devices > 0) return wish.devices;
  int ready = pool.ready() - lost();
  if (!wish.processor) ready = std::max(ready, 1);
  if (ready < std::min(wish.devices, pool.countSoFar() - lost())) ready = 0;
  return choice_.choose(boxes.size, candidatesFor(wish, ready));
}

// Tells of devices that were left out, whichever space met them first, and of those that failed
// this space. `reason`: why the space has none any more, where nothing else says so.
void DeviceBackend::reportFailures(const std::string& reason) {
  const std::vector<FailedDevice> left_out = DevicePool::get().takeFailures();
  std::vector<FailedDevice> failed;
  if (finder_) failed = finder_->sweep->takeFailures();
  if (left_out.empty() && failed.empty() && !failed_) return;
  const int left = failed_ ? 0 : DevicePool::get().countSoFar() - lost();
  choice_.lost(left);
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

void DeviceBackend::learn(const Wish& wish, int devices, std::size_t boxes, std::size_t pairs,
                          double ms) {
  if (failed_ || (!wish.processor && wish.devices > 0)) return;
  devices = std::min(devices, BackendChoice::most_devices);
  choice_.learn(devices, boxes, pairs, ms);
  DevicePool& pool = DevicePool::get();
  if (pool.hasFailures()) reportFailures({});
  const int usable = pool.countSoFar() - lost();
  const int wanted = choice_.wanted(boxes, candidatesFor(wish, usable), pool.ready() - lost());
  if (wanted > 0) pool.prepare(std::min(wanted + lost(), pool.countSoFar()));
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
int DeviceBackend::choose(const BoxSet&, const Wish&) {
  return 0;
}
int DeviceBackend::find(const BoxSet&, int, int, PairList&) {
  return 0;
}
int DeviceBackend::findByAxisLists(const BoxSet&, int, int, std::uint64_t, PairList&) {
  return 0;
}
void DeviceBackend::learn(const Wish&, int, std::size_t, std::size_t, double) {}
std::size_t DeviceBackend::bytes() const {
  return 0;
}

#endif

}  // namespace ode_parallel_sap
