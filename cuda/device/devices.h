// Which devices there are, and how one fails. No CUDA type in here.
#pragma once

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

namespace ode_parallel_sap {

// The device, its memory or its driver failed. what() gives the call and the driver's reason. The
// boxes are untouched, so that the caller can find the pairs elsewhere.
class DeviceFailure : public std::runtime_error {
 public:
  explicit DeviceFailure(const std::string& what, bool out_of_memory = false)
      : std::runtime_error(what), out_of_memory(out_of_memory) {}

  const bool out_of_memory;  // there may be memory later; all else is final
};

// The program has destroyed what the driver kept of a device (cudaDeviceReset). All that was there
// is gone; it can be made ready anew.
class DeviceWasReset : public DeviceFailure {
 public:
  DeviceWasReset() : DeviceFailure("the program has reset it") {}
};

struct FailedDevice {
  int device;  // as the driver counts them
  std::string reason;
  bool out_of_memory;
};

// When what was out of memory is tried again: at growing intervals. For use by any number of
// threads at once.
class MemoryRetry {
 public:
  void failed();
  void paid() { next_ = 0; }
  bool waits() const { return next_ != 0 && !isDue(); }
  bool isDue() const;

 private:
  std::atomic<std::chrono::steady_clock::rep> next_{0}, interval_{0};  // 0: none
};

// The devices that this build has code for, as the driver counts them. Loads the driver but creates
// no context. Where there is none, `why` (if not null) gets the reason.
std::vector<int> cudaDevices(std::string* why = nullptr);

}  // namespace ode_parallel_sap
