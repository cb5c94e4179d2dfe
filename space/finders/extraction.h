// The extraction stage: boxes in, pairs out, by the method and on the back end of the plan.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "space/base/pair_list.h"
#include "space/pairs/sweep.h"
#include "space/paper/axis_lists.h"
#include "space/paper/brute_force.h"

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

// How the pairs were found.
struct Found {
  int method = 0;                        // that ran
  int devices = 0;                       // that found the pairs
  int threads = 1;                       // used, of those of the CPU
  std::optional<ListsTooLong> too_long;  // why it is not the method AxisLists
};

class Extraction {
 public:
  // Makes `pairs` those of overlapping boxes that the test keeps. Throws std::bad_alloc.
  Found find(const BoxSet& boxes, ExtractionPlan plan, const PairTest& test, PairList& pairs) try {
    Found found;
    found.method = plan.method;
    if (plan.devices > 0) found.devices = devices.find(boxes, plan, pairs, test);
    if (found.devices == 0)
      found.threads = finderOf(plan.method, boxes.wide).find(boxes, plan.threads, pairs, &test);
    return found;
  } catch (const ListsTooLong& lists) {
    plan.method = dParallelSAPMethodSweep;
    Found found = find(boxes, plan, test, pairs);
    found.too_long = lists;
    return found;
  }

  // Gives back what is held, but for the devices: that took too long to get.
  void release() {
    brute_force_ = {};
    wide_brute_force_ = {};
    sweep = {};
    wide_sweep_ = {};
    axis_lists_ = {};
  }
  std::size_t bytes() const {
    return bytesOf(brute_force_, wide_brute_force_, sweep, wide_sweep_, axis_lists_, devices);
  }

  Sweep<float> sweep;
  DeviceBackend devices;

 private:
  PairFinder& finderOf(int method, bool wide) {
    if (method == dParallelSAPMethodAxisLists) return axis_lists_;
    if (method == dParallelSAPMethodBruteForce)
      return wide ? static_cast<PairFinder&>(wide_brute_force_) : brute_force_;
    return wide ? static_cast<PairFinder&>(wide_sweep_) : sweep;
  }

  BruteForce<float> brute_force_;
  BruteForce<double> wide_brute_force_;  // for boxes of doubles
  Sweep<double> wide_sweep_;
  AxisLists axis_lists_;
};

}  // namespace ode_parallel_sap
