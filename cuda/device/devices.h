// Which devices there are, how one fails and how long it takes. No CUDA type in here.
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

// How long the stages of the last find() took on the device, in milliseconds; filled only while
// measuring. The stages follow each other without a gap, except that boxes arrive during `upload`
// and pairs leave during `lists`.
struct CudaStageTimes {
  float upload = 0;      // first box sent until the last one is on the device
  float classify = 0;    // classes of sizes, keys
  float sort = 0;        // boxes along the curve
  float cells = 0;       // cells cut, packed and put into a tree
  float search = 0;      // pairs found
  float scan = 0;        // places of the lists
  float scatter = 0;     // pairs put into their lists
  float lists = 0;       // lists sorted
  float host_wait = 0;   // on the host: from the last box sent to the number of pairs known
  float host_pairs = 0;  // on the host: from there to the last pair written
  // Of several devices those of the first; `scan` and `scatter` include what they tell each other.
  // All stages from the last box's arrival to the last list sorted.
  float device() const { return classify + sort + cells + search + scan + scatter + lists; }
};

// The devices that this build has code for, as the driver counts them. Loads the driver but creates
// no context. Where there is none, `why` (if not null) gets the reason.
std::vector<int> cudaDevices(std::string* why = nullptr);

}  // namespace ode_parallel_sap
