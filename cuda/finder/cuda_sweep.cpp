#include "cuda/finder/cuda_sweep.h"

#include <algorithm>

#include "cuda/one/device_sweep.h"
#include "cuda/several/device_group.h"

namespace ode_parallel_sap {

CudaSweep::CudaSweep(DeviceSource devices) : source_(std::move(devices)) {}
CudaSweep::CudaSweep(const std::vector<int>& devices)
    : source_([devices](std::size_t i) { return i < devices.size() ? devices[i] : -1; }) {}
CudaSweep::~CudaSweep() = default;

void CudaSweep::useDevices(int count) {
  wanted_ = static_cast<std::size_t>(std::clamp(count, 1, device::most_parts));
}

// The calling thread drives the devices alone; all decide what boxes cannot.
int CudaSweep::find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) {
  times_ = {};
  if (std::exchange(was_reset_, false)) throw DeviceWasReset();
  for (;;) {
    takeDevices();
    if (devices_used_ == 0)
      throw failures_.empty()
          ? DeviceFailure("no device is left")
          : DeviceFailure(failures_.back().reason, failures_.back().out_of_memory);
    const std::size_t left = sweeps_.size();
    if (boxes.size < 2)
      pairs.clear(1);
    else
      onDevices([&](DeviceGroup& group) { group.find(boxes, pairs); });
    if (sweeps_.size() == left) break;
  }
  pairs.decide(test, threads);
  return 1;
}

void CudaSweep::takeDevices() {
  for (int device; sweeps_.size() < wanted_ && (device = source_(taken_)) >= 0; ++taken_) try {
      auto sweep = std::make_unique<DeviceSweep>(device);
      for (const auto& other : sweeps_) linkDevices(other->driverContext(), sweep->driverContext());
      sweeps_.push_back(std::move(sweep));
    } catch (const DeviceFailure& failure) {
      failures_.push_back({device, failure.what(), failure.out_of_memory});
    }
  devices_used_ = std::min(wanted_, sweeps_.size());
}

void CudaSweep::read(const BoxSet& boxes, std::size_t first, std::size_t last) try {
  takeDevices();
  if (devices_used_ > 0) onDevices([&](DeviceGroup& group) { group.bring(boxes, first, last); });
} catch (const DeviceWasReset&) {
  was_reset_ = true;
} catch (const std::bad_alloc&) {  // find() meets it again
}

void CudaSweep::forget() {
  for (const auto& sweep : sweeps_)
    if (sweep->brought() > 0) sweep->wait();
}

// Only what the device did is its failure.
template <class Work>
void CudaSweep::onDevices(Work work) {
  std::vector<DeviceSweep*> members;
  for (std::size_t i = 0; i < devices_used_; ++i) {
    sweeps_[i]->times = measuring_ && i == 0 ? &times_ : nullptr;
    members.push_back(sweeps_[i].get());
  }
  DeviceGroup group(members);
  try {
    work(group);
  } catch (const DeviceWasReset&) {
    throw;
  } catch (const DeviceFailure& failure) {
    failures_.push_back({members[group.failed()]->device(), failure.what(), failure.out_of_memory});
    sweeps_.erase(sweeps_.begin() + static_cast<std::ptrdiff_t>(group.failed()));
  }
}

std::size_t CudaSweep::bytes() const {
  std::size_t bytes = 0;
  for (const auto& sweep : sweeps_)
    if (sweep->context()) bytes += sweep->context()->hostBytes();
  return bytes;
}

std::size_t CudaSweep::deviceBytes() const {
  std::size_t bytes = 0;
  for (const auto& sweep : sweeps_)
    if (sweep->context()) bytes += sweep->context()->deviceBytes();
  return bytes;
}

}  // namespace ode_parallel_sap
