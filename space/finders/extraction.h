// The extraction stage: boxes in, pairs out, by the method and on the back end of the plan.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <optional>

#include "space/finders/device_backend.h"
#include "space/pairs/sweep.h"
#include "space/paper/axis_lists.h"
#include "space/paper/brute_force.h"

namespace ode_parallel_sap {

// How the pairs were found.
struct Found {
  int method = 0;                        // that ran
  int devices = 0;                       // that found the pairs
  int threads = 1;                       // used, of those of the CPU
  std::size_t pairs = 0;                 // that were found
  std::optional<ListsTooLong> too_long;  // why it is not the method AxisLists
};

class Extraction {
 public:
  // Makes `pairs` those of the boxes that overlap and that the test keeps. Throws std::bad_alloc
  // where memory ends.
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
