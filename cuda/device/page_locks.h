// Host storage that a device reads and writes where it is.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// Locks the pages of large storage (space/base/storage.h), of which it holds one at a time. They
// are unlocked when the storage is given back, whoever does so, and locked anew after a fork, which
// leaves the program with other pages than the device.
class PageLock {
 public:
  // Whether storage that begins at `data` and has `bytes` is locked for all devices; the calling
  // thread's device is current. Locked when it is asked for the second time in a row, as what lasts
  // for a frame only is not worth it. False where the system does not let it be, which is no
  // failure: the same storage is not tried again.
  bool covers(const void* data, std::size_t bytes);

 private:
  const void* last_ = nullptr;
  std::size_t last_bytes_ = 0;
  bool refused_ = false;
};

}  // namespace ode_parallel_sap
