#include "cuda/finder/cuda_sweep.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "cuda/device/device.h"
#include "cuda/one/device_sweep.h"
#include "cuda/several/share_team.h"

namespace ode_parallel_sap {

namespace {

using Clock = std::chrono::steady_clock;

class CudaSweep final : public CudaPairFinder {
 public:
  explicit CudaSweep(DeviceSource devices) : source_(std::move(devices)) {}

  bool takes(const BoxSet& boxes) const override { return !boxes.wide; }
  void useDevices(int count) override {
    wanted_ = static_cast<std::size_t>(std::clamp(count, 1, most_shares));
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
  void findAlone(DeviceSweep& sweep, const BoxSet& boxes, int threads, PairList& pairs);
  void findTogether(std::size_t devices, const BoxSet& boxes, int threads, PairList& pairs);
  void lose(std::size_t device, const std::exception_ptr& failure);
  void sendBoxes(DeviceSweep& sweep, const BoxSet& boxes, int threads);
  void sendFilters(Context& context, const BoxSet& boxes, int threads);
  void fetchPairs(DeviceSweep& sweep, const BoxSet& boxes, int threads, PairList& pairs);
  void readTimes(const Context& context, Clock::time_point sent, Clock::time_point known,
                 Clock::time_point done);

  DeviceSource source_;
  std::size_t taken_ = 0;                             // of its devices
  std::vector<std::unique_ptr<DeviceSweep>> sweeps_;  // of those that have not failed
  std::unique_ptr<ShareTeam> team_;                   // once several devices were used
  std::size_t wanted_ = 1, devices_used_ = 0;
  int threads_used_ = 1;
  std::vector<FailedDevice> failures_;
  bool measuring_ = false;
  CudaStageTimes times_;
};

int CudaSweep::find(const BoxSet& boxes, int threads, PairList& pairs) {
  if (!takes(boxes)) throw DeviceFailure("boxes of doubles are not for the device");
  threads_used_ = 1;
  times_ = {};
  for (;;) {
    takeDevices();
    devices_used_ = std::min(wanted_, sweeps_.size());
    if (devices_used_ == 0)
      throw DeviceFailure(failures_.empty() ? "no device is left" : failures_.back().reason);
    const std::size_t left = sweeps_.size();
    if (boxes.size < 2)
      pairs.clear(1);
    else if (devices_used_ == 1)
      findAlone(*sweeps_[0], boxes, threads, pairs);
    else
      findTogether(devices_used_, boxes, threads, pairs);
    if (sweeps_.size() == left) return threads_used_;
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
void CudaSweep::lose(std::size_t device, const std::exception_ptr& failure) {
  sweeps_[device]->release();
  try {
    std::rethrow_exception(failure);
  } catch (const DeviceFailure& reason) {
    failures_.push_back({sweeps_[device]->device(), reason.what()});
    if (team_) team_->dismiss(sweeps_[device].get());
    sweeps_.erase(sweeps_.begin() + static_cast<std::ptrdiff_t>(device));
  }
}

void CudaSweep::findTogether(std::size_t devices, const BoxSet& boxes, int threads,
                             PairList& pairs) {
  if (!team_) team_ = std::make_unique<ShareTeam>();
  std::vector<DeviceSweep*> sweeps;
  for (std::size_t i = 0; i < devices; ++i) {
    sweeps_[i]->measuring = false;
    sweeps.push_back(sweeps_[i].get());
  }
  std::vector<std::exception_ptr> failures;
  threads_used_ = std::max(threads_used_, team_->find(boxes, sweeps, threads, pairs, failures));
  times_.host_wait = team_->times().plan + team_->times().search;
  times_.host_pairs = team_->times().join;
  for (std::size_t i = failures.size(); i-- > 0;)
    if (failures[i]) lose(i, failures[i]);
}

void CudaSweep::findAlone(DeviceSweep& sweep, const BoxSet& boxes, int threads, PairList& pairs) {
  try {
    const ScopedDevice device(sweep.driverContext());
    cudaGetLastError();  // not ours
    sweep.measuring = measuring_;
    sweep.begin(boxes.size);
    sendBoxes(sweep, boxes, threads);
    const Clock::time_point sent = Clock::now();
    sweep.mark(Uploaded);
    sweep.start({boxes.size, boxes.size, boxes.filter_bits, boxes.filter_bodies, boxes.exact, {}},
                [&] { sendFilters(*sweep.context(), boxes, threads); });
    sweep.finish();
    const Clock::time_point known = Clock::now();
    fetchPairs(sweep, boxes, threads, pairs);
    if (measuring_) readTimes(*sweep.context(), sent, known, Clock::now());
  } catch (...) {
    // Nothing may be left under way, and nothing is known of the state of what is there.
    lose(0, std::current_exception());
  }
}

std::size_t CudaSweep::bytes() const {
  std::size_t bytes = team_ ? team_->bytes() : 0;
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

// Boxes are counted by bin piece by piece, while the next ones travel.
void CudaSweep::sendBoxes(DeviceSweep& sweep, const BoxSet& boxes, int threads) {
  Context& c = *sweep.context();
  const auto sent = [&](std::size_t begin, std::size_t end) {
    sweep.arrived(begin / sizeof(Box), end / sizeof(Box));
  };
  const Upload::Array array = {boxes.boxes.data(), c.boxes.data(), boxes.size * sizeof(Box),
                               sizeof(Box),
                               c.boxes_lock.covers(boxes.boxes.data(), boxes.boxes.bytes())};
  threads_used_ = std::max(threads_used_, c.upload.run(array, threads, c.up, sent));
}

void CudaSweep::sendFilters(Context& c, const BoxSet& boxes, int threads) {
  const auto send = [&](const auto& from, auto& to, PageLock& lock) {
    to.reserve(boxes.size);
    c.upload.run({from.data(), to.data(), boxes.size * sizeof from[0], sizeof from[0],
                  lock.covers(from.data(), from.bytes())},
                 threads, c.up, [](std::size_t, std::size_t) {});
  };
  if (boxes.filter_bits) send(boxes.bits, c.bits, c.bits_lock);
  if (boxes.filter_bodies) send(boxes.bodies, c.bodies, c.bodies_lock);
  CHECK_CUDA(cudaEventRecord(c.filters_here, c.up));
  CHECK_CUDA(cudaStreamWaitEvent(c.compute, c.filters_here, 0));
}

void CudaSweep::fetchPairs(DeviceSweep& sweep, const BoxSet& boxes, int threads, PairList& pairs) {
  Context& c = *sweep.context();
  const std::size_t total = sweep.pairs();
  pairs.clear(1);
  pairs.parts[0].resizeDiscarding(total);
  if (threads <= device::most_fetching_in_place &&
      c.pairs_lock.covers(pairs.parts[0].data(), pairs.parts[0].bytes())) {
    sweep.sendPairs(pairs);
    return;
  }
  sweep.sortLists(Download::pieceWords(total));
  const Download::Lists lists = {c.segments.data(), total, c.ready, c.host_has_list.data(),
                                 boxes.exact};
  threads_used_ = std::max(threads_used_, c.download.run(lists, threads, c.down, pairs));
}

void CudaSweep::readTimes(const Context& c, Clock::time_point sent, Clock::time_point known,
                          Clock::time_point done) {
  CHECK_CUDA(cudaEventSynchronize(*c.stage_events[Listed]));
  const auto between = [&](Stage begin, Stage end) {
    float ms = 0;
    CHECK_CUDA(cudaEventElapsedTime(&ms, *c.stage_events[begin], *c.stage_events[end]));
    return ms;
  };
  times_.upload = between(Start, Uploaded);
  times_.classify = between(Uploaded, Classified);
  times_.sort = between(Classified, Sorted);
  times_.cells = between(Sorted, Packed);
  times_.search = between(Packed, Searched);
  times_.scan = between(Searched, Scanned);
  times_.scatter = between(Scanned, Scattered);
  times_.lists = between(Scattered, Listed);
  const auto ms = [](Clock::time_point begin, Clock::time_point end) {
    return std::chrono::duration<float, std::milli>(end - begin).count();
  };
  times_.host_wait = ms(sent, known);
  times_.host_pairs = ms(known, done);
}

}  // namespace

std::unique_ptr<CudaPairFinder> makeCudaSweep(DeviceSource devices) {
  return std::make_unique<CudaSweep>(std::move(devices));
}

std::unique_ptr<CudaPairFinder> makeCudaSweep(const std::vector<int>& devices) {
  return makeCudaSweep([devices](std::size_t i) { return i < devices.size() ? devices[i] : -1; });
}

}  // namespace ode_parallel_sap
