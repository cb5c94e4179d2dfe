// Which devices there are, and how one fails. No CUDA type in here.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace ode_parallel_sap {

// The device, its memory or its driver failed. what() gives the call and the driver's reason. The
// boxes are untouched, so that the caller can find the pairs elsewhere.
class DeviceFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct FailedDevice {
  int device;  // as the driver counts them
  std::string reason;
};

// The devices that this build has code for, as the driver counts them. Loads the driver but creates
// no context. Where there is none, `why` (if not null) gets the reason.
std::vector<int> cudaDevices(std::string* why = nullptr);

}  // namespace ode_parallel_sap
