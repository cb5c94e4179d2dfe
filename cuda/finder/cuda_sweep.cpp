#include "cuda/finder/cuda_sweep.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "cuda/device/device.h"
#include "cuda/one/device_sweep.h"
#include "cuda/several/device_group.h"

namespace ode_parallel_sap {

namespace {

class CudaSweep final : public CudaPairFinder {
 public:
  explicit CudaSweep(DeviceSource devices) : source_(std::move(devices)) {}

  bool takes(const BoxSet& boxes) const override { return !boxes.wide; }
  void useDevices(int count) override {
    wanted_ = static_cast<std::size_t>(std::clamp(count, 1, device::most_parts));
  }
  int devicesLost() const override { return static_cast<int>(taken_ - sweeps_.size()); }
  int find(const BoxSet& boxes, int threads, PairList& pairs) override;
  std::vector<FailedDevice> takeFailures() override { return std::exchange(failures_, {}); }
  int devicesUsed() const override { return static_cast<int>(devices_used_); }
  std::size_t bytes() const override;
  std::size_t deviceBytes() const override;
  void measure(bool on) override { measuring_ = on; }
  const CudaStageTimes& times() const override { return times_; }

 private:
  void takeDevices();
  void findOn(std::size_t devices, const BoxSet& boxes, PairList& pairs);
  void lose(std::size_t device, const DeviceFailure& failure);
  void readTimes(const Context& first, const DeviceGroup::Times& host);

  DeviceSource source_;
  std::size_t taken_ = 0;                             // of its devices
  std::vector<std::unique_ptr<DeviceSweep>> sweeps_;  // of those that have not failed
  std::size_t wanted_ = 1, devices_used_ = 0;
  std::vector<FailedDevice> failures_;
  bool measuring_ = false;
  CudaStageTimes times_;
};

// The calling thread drives the devices alone.
int CudaSweep::find(const BoxSet& boxes, int, PairList& pairs) {
  if (!takes(boxes)) throw DeviceFailure("boxes of doubles are not for the device");
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
    if (sweeps_.size() == left) return 1;
  }
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
void CudaSweep::lose(std::size_t device, const DeviceFailure& failure) {
  failures_.push_back({sweeps_[device]->device(), failure.what(), failure.out_of_memory});
  sweeps_.erase(sweeps_.begin() + static_cast<std::ptrdiff_t>(device));
}

void CudaSweep::findOn(std::size_t devices, const BoxSet& boxes, PairList& pairs) {
  std::vector<DeviceSweep*> members;
  for (std::size_t i = 0; i < devices; ++i) {
    sweeps_[i]->measuring = measuring_ && i == 0;
    members.push_back(sweeps_[i].get());
  }
  DeviceGroup group(std::move(members));
  try {
    group.find(boxes, pairs);
    if (measuring_) group.onFirst([&](const Context& first) { readTimes(first, group.times()); });
  } catch (const DeviceWasReset&) {
    throw;
  } catch (const DeviceFailure& failure) {
    lose(group.failed(), failure);
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

void CudaSweep::readTimes(const Context& c, const DeviceGroup::Times& host) {
  using Clock = DeviceGroup::Clock;
  const auto ms = [](Clock::time_point begin, Clock::time_point end) {
    return std::chrono::duration<float, std::milli>(end - begin).count();
  };
  times_.host_wait = ms(host.sent, host.known);
  times_.host_pairs = ms(host.known, host.done);
  const auto between = [&](DeviceStage begin, DeviceStage end) {
    float between_ms = 0;
    CHECK_CUDA(cudaEventElapsedTime(&between_ms, *c.stage_events[begin], *c.stage_events[end]));
    return between_ms;
  };
  CHECK_CUDA(cudaEventSynchronize(*c.stage_events[Listed]));
  times_.upload = between(Start, Uploaded);
  times_.classify = between(Uploaded, Classified);
  times_.sort = between(Classified, Sorted);
  times_.cells = between(Sorted, Packed);
  times_.search = between(Packed, Searched);
  times_.scan = between(Searched, Scanned);
  times_.scatter = between(Scanned, Scattered);
  times_.lists = between(Scattered, Listed);
}

}  // namespace

std::unique_ptr<CudaPairFinder> makeCudaSweep(DeviceSource devices) {
  return std::make_unique<CudaSweep>(std::move(devices));
}

std::unique_ptr<CudaPairFinder> makeCudaSweep(const std::vector<int>& devices) {
  return makeCudaSweep([devices](std::size_t i) { return i < devices.size() ? devices[i] : -1; });
}

}  // namespace ode_parallel_sap
