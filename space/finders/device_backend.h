// The CUDA back end as the space sees it, whether or not this build has one.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Whether this build has the back end and this machine a device for it. Loads the driver at the
// first call, and has another thread make the first device ready, so that no frame waits for that
// if the program loads something meanwhile. One that does without the back end never comes here.
// `missing`: gets what is missing of the build, the driver and the device.
bool deviceAvailable(std::string* missing = nullptr);

// What the policy decided of the extraction.
struct ExtractionPlan {
  int method = 0;   // a dParallelSAPMethod, never Auto
  int devices = 0;  // 0: on the CPU
  int threads = 1;
};

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

  // Who reads boxes for a find() by that plan while others are packed; null: nobody.
  BoxReader* reader(const ExtractionPlan& plan);
  // As PairFinder::find, by the plan's method, on the plan's devices; returns how many found
  // the pairs. 0, with nothing in `pairs`, where devices do not take such boxes or methods or all
  // have failed: the caller then finds the pairs itself. A device that fails is reported once
  // through dMessage and not used again by this space; one that cannot be made ready is not used by
  // any. One that is out of memory is tried again at growing intervals, one that the
  // program has reset at once. Throws ListsTooLong where
  // the memory of one of them does not suffice.
  int find(const BoxSet& boxes, const ExtractionPlan& plan, PairList& pairs, const PairTest& test);
  // Reports the devices that could not be made ready meanwhile.
  void reportLeftOut();
  std::size_t bytes() const;

 private:
  struct Finder;
  int lost() const;
  void reportFailures(const std::string& reason);
  int findByAxisLists(const BoxSet& boxes, const ExtractionPlan& plan, PairList& pairs,
                      const PairTest& test);

  std::unique_ptr<Finder> finder_;
  bool failed_ = false;
};

}  // namespace ode_parallel_sap
