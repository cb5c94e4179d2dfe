// The sweep on CUDA devices, as the rest of the library sees it. No CUDA type in here.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "cuda/device/devices.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

class DeviceSweep;

// Where a finder gets its devices from: the i-th, counted from 0, or -1 where there are not so
// many. The same one may come more than once, and stands for several then. All are of one
// generation (compute capability).
using DeviceSource = std::function<int(std::size_t i)>;

// The sweep on one or several devices. Finds what Sweep<float> finds, in boxes of floats. Not for
// use by two threads at once; finders may share devices.
class CudaSweep final : public PairFinder, public BoxReader {
 public:
  // On the first of these devices, as many as it is told to use. Touches neither driver nor device,
  // nor asks the source; find() does.
  explicit CudaSweep(DeviceSource devices);
  explicit CudaSweep(const std::vector<int>& devices = {0});
  ~CudaSweep() override;

  // With more than one, several devices share each scene, whatever its size. At least 1; more than
  // there are left are taken as all of them.
  void useDevices(int count);
  // A device that fails is not used again; what it leaves undone the others do, among them those
  // that its source has in reserve. Throws DeviceFailure when the last one has failed,
  // DeviceWasReset when one was, and std::bad_alloc.
  using PairFinder::find;
  int find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) override;
  // For the find() to come. A device that fails here has failed, as there; find() tells of a reset.
  void read(const BoxSet& boxes, std::size_t first, std::size_t last) override;
  void forget() override;
  // How many have failed.
  int devicesLost() const { return static_cast<int>(taken_ - sweeps_.size()); }
  // Those that have failed since the last call.
  std::vector<FailedDevice> takeFailures() { return std::exchange(failures_, {}); }
  // That found the pairs of the last find().
  int devicesUsed() const { return static_cast<int>(devices_used_); }
  // Host memory only; see deviceBytes.
  std::size_t bytes() const override;
  std::size_t deviceBytes() const;
  // Stage times cost a few events a frame, so they have to be asked for.
  void measure(bool on) { measuring_ = on; }
  const CudaStageTimes& times() const { return times_; }

 private:
  void takeDevices();
  template <class Work>
  void onDevices(Work work);

  DeviceSource source_;
  std::size_t taken_ = 0;                             // of its devices
  std::vector<std::unique_ptr<DeviceSweep>> sweeps_;  // of those that have not failed
  std::size_t wanted_ = 1, devices_used_ = 0;
  std::vector<FailedDevice> failures_;
  bool was_reset_ = false;  // a device, as read() met
  bool measuring_ = false;
  CudaStageTimes times_;
};

}  // namespace ode_parallel_sap
