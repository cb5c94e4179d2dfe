// The CUDA back end as the space sees it, whether or not this build has one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "space/base/pair_finder.h"

namespace ode_parallel_sap {

// Whether this build has the back end and this machine a device for it. Loads the driver at the
// first call; a program that never asks for the back end never comes here.
bool deviceAvailable();

// One space's share of the devices.
class DeviceBackend {
 public:
  // What there is for this space, as far as is known without loading the driver.
  struct Devices {
    bool any = false;  // in this build, and not all of them failed this space
    int ready = 0;     // a frame does not wait for these
    int usable = 0;
  };

  DeviceBackend();
  ~DeviceBackend();

  Devices devices() const;
  // Has another thread make so many devices ready for this space.
  void prepare(int devices);

  // As PairFinder::find, on `devices` devices; returns how many found the pairs. 0, with nothing in
  // `pairs`, where devices do not take such boxes or all have failed: the caller then finds the
  // pairs itself. A device that fails is reported once through dMessage and not used again by this
  // space; one that cannot be made ready is not used by any.
  int find(const BoxSet& boxes, int threads, int devices, PairList& pairs);
  // The same by the method AxisLists, on up to so many devices, at least 1. Throws ListsTooLong
  // where the memory of one of them, or `most_bytes` unless that is 0, does not suffice.
  int findByAxisLists(const BoxSet& boxes, int threads, int devices, std::uint64_t most_bytes,
                      PairList& pairs);
  // Reports the devices that could not be made ready meanwhile.
  void reportLeftOut();
  // Whether devices were reported as failed or left out since this was last asked.
  bool takeLoss();
  std::size_t bytes() const;

 private:
  struct Finder;
  int lost() const;
  void reportFailures(const std::string& reason);
  template <class Work>
  int attempt(PairList& pairs, Work work);

  std::unique_ptr<Finder> finder_;
  bool failed_ = false;
  bool loss_ = false;  // not taken yet
};

}  // namespace ode_parallel_sap
