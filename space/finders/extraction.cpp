#include "space/finders/extraction.h"

#include <utility>

#include <ode/ode.h>

#if ODE_PARALLEL_SAP_HAS_CUDA
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "cuda/axis_lists/cuda_axis_lists.h"
#include "cuda/finder/cuda_sweep.h"
#include "cuda/finder/device_pool.h"
#endif

namespace ode_parallel_sap {

#if ODE_PARALLEL_SAP_HAS_CUDA

struct DeviceBackend::Finder {
  std::optional<CudaSweep> sweep;
  std::optional<CudaAxisLists> axis_lists;
  MemoryRetry retry;           // of devices that it has lost for want of memory
  bool all_are_full = false;   // until then
  bool full_are_said = false;  // once is enough
  bool has_lost_others = false;
  bool reset_is_said = false;

  Finder() { takeAll(); }
  void takeAll() {
    axis_lists.reset();
    sweep.emplace([](std::size_t i) { return DevicePool::get().device(i); });
    all_are_full = false;
    retry.paid();
  }
};

DeviceBackend::DeviceBackend() = default;
// What a child has of devices is its parent's.
DeviceBackend::~DeviceBackend() {
  if (finder_ && DevicePool::isLost()) (void)finder_.release();
}

bool deviceAvailable(std::string* missing) {
  DevicePool& pool = DevicePool::get();
  if (pool.count() == 0 && !pool.hasFull()) {
    if (missing && DevicePool::isLost())
      *missing = "this process was forked by one that uses the GPU";
    else if (missing && !cudaDevices(missing).empty())
      *missing = "the devices cannot be used";
    return false;
  }
  pool.prepare(1);
  return true;
}

int DeviceBackend::lost() const {
  return finder_ ? finder_->sweep->devicesLost() : 0;
}

DeviceBackend::Devices DeviceBackend::devices() const {
  if (failed_ || DevicePool::isLost()) return {};
  if (finder_ && finder_->all_are_full && finder_->retry.waits()) return {};
  const DevicePool& pool = DevicePool::get();
  return {true, pool.ready() - lost(), pool.countSoFar() - lost()};
}

void DeviceBackend::prepare(int devices) {
  DevicePool& pool = DevicePool::get();
  pool.prepare(std::min(devices + lost(), pool.countSoFar()));
}

// Reports devices that were left out, whichever space met them first, and those that failed this
// space. `reason`: why the space has none any more, where no other message does.
void DeviceBackend::reportFailures(const std::string& reason) {
  const std::vector<FailedDevice> left_out = DevicePool::get().takeFailures();
  std::vector<FailedDevice> failed;
  if (finder_) failed = finder_->sweep->takeFailures();
  const bool all_full = finder_ && finder_->all_are_full;
  if (left_out.empty() && failed.empty() && !failed_ && !all_full) return;
  bool own_full = all_full;
  for (const FailedDevice& device : failed) {
    own_full = own_full || device.out_of_memory;
    finder_->has_lost_others = finder_->has_lost_others || !device.out_of_memory;
  }
  if (own_full && !finder_->has_lost_others) {
    finder_->retry.failed();
    if (std::exchange(finder_->full_are_said, true) && left_out.empty()) return;
  }
  const int left = failed_ || all_full ? 0 : DevicePool::get().countSoFar() - lost();
  const bool until_memory = !failed_ && (own_full || DevicePool::get().hasFull());
  const std::string then = left > 0       ? "; GPUs left: " + std::to_string(left)
                           : until_memory ? ", pairs are found on the CPU until there is memory"
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

BoxReader* DeviceBackend::reader(const ExtractionPlan& plan) {
  if (!finder_) return nullptr;
  finder_->sweep->forget();  // boxes of a frame that ended before it found pairs
  if (plan.devices == 0 || plan.method != dParallelSAPMethodSweep || finder_->retry.isDue())
    return nullptr;
  finder_->sweep->useDevices(plan.devices);
  return &*finder_->sweep;
}

// Where the last device fails, that was the last time.
int DeviceBackend::find(const BoxSet& boxes, const ExtractionPlan& plan, PairList& pairs,
                        const PairTest& test) {
  const bool by_lists = plan.method == dParallelSAPMethodAxisLists;
  if (failed_ || (!by_lists && (plan.method != dParallelSAPMethodSweep || boxes.wide))) return 0;
  if (!finder_) finder_ = std::make_unique<Finder>();
  if (finder_->retry.isDue()) finder_->takeAll();
  int used = 0;
  std::string reason;
  try {
    if (by_lists) {
      used = findByAxisLists(boxes, plan, pairs, test);
    } else {
      finder_->sweep->useDevices(plan.devices);
      finder_->sweep->find(boxes, plan.threads, pairs, &test);
      used = finder_->sweep->devicesUsed();
    }
  } catch (const DeviceWasReset&) {
    DevicePool::get().wereReset();
    finder_->takeAll();
    pairs.clear(1);
    if (!std::exchange(finder_->reset_is_said, true))
      dMessage(0,
               "parallel SAP space: the program has reset a GPU, which is made ready anew; until "
               "then pairs are found on the CPU");
  } catch (const DeviceFailure& failure) {
    reason = failure.what();
    const bool all_left_out = lost() == 0 && DevicePool::get().hasFull();
    finder_->all_are_full = (failure.out_of_memory || all_left_out) && !finder_->has_lost_others;
    failed_ = !finder_->all_are_full;
    pairs.clear(1);
  }
  reportFailures(reason);
  if (failed_) finder_.reset();
  return used;
}

int DeviceBackend::findByAxisLists(const BoxSet& boxes, const ExtractionPlan& plan, PairList& pairs,
                                   const PairTest& test) {
  if (!finder_->axis_lists) finder_->axis_lists.emplace();
  CudaAxisLists& lists = *finder_->axis_lists;
  std::vector<int> used;
  for (int device; static_cast<int>(used.size()) < plan.devices; used.push_back(device)) {
    device = DevicePool::get().device(used.size());
    if (device < 0) break;
  }
  if (used.empty()) throw DeviceFailure("no device is left");
  lists.useDevices(used);
  lists.find(boxes, plan.threads, pairs, &test);
  return static_cast<int>(used.size());
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

DeviceBackend::DeviceBackend() = default;
DeviceBackend::~DeviceBackend() = default;

bool deviceAvailable(std::string* missing) {
  if (missing) *missing = "this build is without CUDA";
  return false;
}
DeviceBackend::Devices DeviceBackend::devices() const {
  return {};
}
void DeviceBackend::prepare(int) {}
BoxReader* DeviceBackend::reader(const ExtractionPlan&) {
  return nullptr;
}
int DeviceBackend::find(const BoxSet&, const ExtractionPlan&, PairList&, const PairTest&) {
  return 0;
}
void DeviceBackend::reportLeftOut() {}
std::size_t DeviceBackend::bytes() const {
  return 0;
}

#endif

}  // namespace ode_parallel_sap
