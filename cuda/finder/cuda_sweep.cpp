#include "cuda/finder/cuda_sweep.h"

#include <algorithm>
#include <utility>

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
  for (;;) {
    takeDevices();
    devices_used_ = std::min(wanted_, sweeps_.size());
    if (devices_used_ == 0)
      throw failures_.empty()
          ? DeviceFailure("no device is left")
          : DeviceFailure(failures_.back().reason, failures_.back().out_of_memory);
    const std::size_t left = sweeps_.size();
    if (boxes.size < 2)
      pairs.clear(1);
    else
      findOn(devices_used_, boxes, pairs);
    if (sweeps_.size() == left) break;
  }
  pairs.decide(test, threads);
  return 1;
}

void CudaSweep::takeDevices() {
  while (sweeps_.size() < wanted_) {
    const int device = source_(taken_);
    if (device < 0) return;
    sweeps_.push_back(std::make_unique<DeviceSweep>(device));
    ++taken_;
  }
}

// Only what the device did is its failure.
void CudaSweep::findOn(std::size_t devices, const BoxSet& boxes, PairList& pairs) {
  std::vector<DeviceSweep*> members;
  for (std::size_t i = 0; i < devices; ++i) {
    sweeps_[i]->times = measuring_ && i == 0 ? &times_ : nullptr;
    members.push_back(sweeps_[i].get());
  }
  DeviceGroup group(members);
  try {
    group.find(boxes, pairs);
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
