// The CUDA back end as the space sees it, whether or not this build has one.
#ifndef ODE_PARALLEL_SAP_DEVICE_BACKEND_H
#define ODE_PARALLEL_SAP_DEVICE_BACKEND_H

#include <cstddef>
#include <cstdint>
#include <memory>

#include "pair_finder.h"

namespace ode_parallel_sap {

// Whether this build has the back end and this machine a device for it. Loads the driver at the
// first call; a program that never asks for the back end never comes here.
bool deviceAvailable();

// One space's share of the device.
class DeviceBackend {
 public:
  DeviceBackend();
  ~DeviceBackend();

  // As PairFinder::find, on the device. False, with nothing in `pairs`, where the device does not
  // take such boxes or fails: the caller then finds the pairs itself. A failure is reported once
  // through dMessage, and the device is not tried again by this space.
  bool find(const BoxSet& boxes, int threads, PairList& pairs);
  // The same by the method AxisLists on up to so many devices, at least 1. Throws ListsTooLong
  // where the memory of one of them, or `most_bytes` unless that is 0, does not suffice.
  bool findByAxisLists(const BoxSet& boxes, int threads, int devices, std::uint64_t most_bytes,
                       PairList& pairs);
  // Devices that the last find used.
  int devices() const { return devices_; }
  std::size_t bytes() const;

 private:
  struct Finder;
  template <class Work>
  bool attempt(PairList& pairs, Work work);

  std::unique_ptr<Finder> finder_;
  int devices_ = 0;
  bool failed_ = false;
};

}  // namespace ode_parallel_sap

#endif
