// Which of the machine's devices can be used.
#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>
#include <thread>
#include <vector>

#include "cuda/device/devices.h"

namespace ode_parallel_sap {

// The devices of this machine, for all spaces of the program. One that cannot be made ready, or is
// of another generation than the first, with which it could not share a scene, is left out for the
// rest of the program; one that has no memory is tried again later. Meanwhile the others are
// counted as if it were not there. The child of a process that asked the driver has no devices. For
// use by any number of threads at once.
class DevicePool {
 public:
  static DevicePool& get();

  // This process is such a child: whatever it has of devices is its parent's.
  static bool isLost() { return lost_; }
  // How many there are that have not been left out. Asks the driver when called for the first time.
  int count();
  // The same without asking: there may be one.
  int countSoFar() const {
    return isLost() ? 0 : count_ + (retry_.isDue() ? full_count_.load() : 0);
  }
  // Those made ready so far.
  int ready() const { return isLost() ? 0 : ready_.load(); }
  // The i-th, counted from 0, as the driver counts them; -1: there are not so many. Made ready
  // first if need be, which takes up to a second.
  int device(std::size_t i);
  // Has the first `wanted` made ready by another thread, and returns at once.
  void prepare(int wanted);
  // The program has reset devices: they are to be made ready anew.
  void wereReset();

  // Whether takeFailures() has something to tell; for every frame.
  bool hasFailures() const { return has_failures_ && !isLost(); }
  // Whether some are left out for want of memory.
  bool hasFull() const { return full_count_ > 0; }
  // Devices that have been left out since the last call; each is told of once.
  std::vector<FailedDevice> takeFailures();

 private:
  DevicePool();
  ~DevicePool();
  void makeReady(int device);
  static void findSmallScene(int device);
  void tryFullOnes();
  void addFull(int device);
  void leaveOut(int device, const DeviceFailure& failure);

  inline static std::atomic<bool> used_{false}, lost_{false};

  std::once_flag asked_;
  std::vector<int> listed_;
  std::vector<int> usable_;  // has room for all: those before ready_ are read by any thread
  std::atomic<int> count_{1}, ready_{0};
  std::mutex making_ready_;                   // for what follows
  std::size_t tried_ = 0;                     // of those listed
  std::vector<int> left_out_, full_, named_;  // those named were full once
  std::atomic<int> full_count_{0};
  MemoryRetry retry_;

  std::mutex telling_;  // for what follows
  std::vector<FailedDevice> failures_;
  std::atomic<bool> has_failures_{false};

  std::atomic<bool> busy_{false};
  std::thread thread_;
};

}  // namespace ode_parallel_sap
