// Host storage that a device reads and writes where it is.
#pragma once

#include <cstddef>

#include "cuda/device/device.h"

namespace ode_parallel_sap {

// Locks the pages of large storage (space/base/buffer.h), of which it holds one at a time. They
// are unlocked when the storage is given back, whoever does so, and locked anew after a fork, which
// leaves the program with other pages than the device, and after the device was reset.
class PageLock {
 public:
  // Locks storage that begins at `data` and has `bytes`, for all devices, when it is called with it
  // the second time in a row: what lasts for a frame only is not worth it. `context` is current for
  // the calling thread. That the system does not let it is no failure: copies are slower, and the
  // same storage is not tried again.
  void lock(const void* data, std::size_t bytes, const DriverContext& context);
  // What was locked last, as the device knows it; null if it is not locked.
  void* mapped() const { return mapped_; }

 private:
  void* mapped_ = nullptr;
  const void* last_ = nullptr;
  std::size_t last_bytes_ = 0;
  bool refused_ = false;
};

}  // namespace ode_parallel_sap
