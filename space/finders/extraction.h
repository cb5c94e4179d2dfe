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

// The methods that run on the CPU for boxes of floats or of doubles.
template <class Real>
struct FindersOf {
  BruteForce<Real> brute_force;
  Sweep<Real> sweep;

  PairFinder& of(int method) {
    if (method == dParallelSAPMethodBruteForce) return brute_force;
    return sweep;
  }
  std::size_t bytes() const { return bytesOf(brute_force, sweep); }
};

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
    if (plan.devices > 0) found.devices = devices_.find(boxes, plan, pairs, test);
    if (found.devices > 0) return found;
    PairFinder& finder = plan.method == dParallelSAPMethodAxisLists ? axis_lists_
                         : boxes.wide                               ? doubles_.of(plan.method)
                                                                    : floats_.of(plan.method);
    found.threads = finder.find(boxes, plan.threads, pairs, &test);
    return found;
  } catch (const ListsTooLong& lists) {
    plan.method = dParallelSAPMethodSweep;
    Found found = find(boxes, plan, test, pairs);
    found.too_long = lists;
    return found;
  }

  Sweep<float>& sweep() { return floats_.sweep; }
  DeviceBackend& devices() { return devices_; }

  // Gives back what is held, but for the devices: that took too long to get.
  void release() {
    floats_ = {};
    doubles_ = {};
    axis_lists_ = {};
  }
  std::size_t bytes() const { return bytesOf(floats_, doubles_, axis_lists_, devices_); }

 private:
  FindersOf<float> floats_;
  FindersOf<double> doubles_;
  AxisLists axis_lists_;
  DeviceBackend devices_;
};

}  // namespace ode_parallel_sap
