// The extraction stage: boxes in, pairs out, by the method and on the back end of the plan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "space/finders/cpu_finders.h"
#include "space/finders/device_backend.h"

namespace ode_parallel_sap {

// How the pairs were found.
struct Found {
  int method = 0;                        // that ran
  int devices = 0;                       // that found the pairs
  int threads = 1;                       // used, of those of the CPU
  std::size_t pairs = 0;                 // candidates, before the filter
  std::optional<ListsTooLong> too_long;  // why it is not the method AxisLists
};

class Extraction {
 public:
  // Makes `pairs` those of the boxes that overlap. Throws std::bad_alloc where memory ends.
  Found find(const BoxSet& boxes, const ExtractionPlan& plan, PairList& pairs);

  // Made when a frame first needs them: about 25 KB before the first box.
  CPUFinders& finders();
  Sweep<float>& sweep() { return finders().narrow.sweep; }
  DeviceBackend& devices() { return devices_; }
  const DeviceBackend& devices() const { return devices_; }

  // Gives back what is held, but for the devices: that took too long to get.
  void release() { finders_.reset(); }
  std::size_t bytes() const { return bytesOf(finders_, devices_); }

 private:
  Found findBy(int method, const BoxSet& boxes, const ExtractionPlan& plan, PairList& pairs);

  std::unique_ptr<CPUFinders> finders_;
  DeviceBackend devices_;
};

}  // namespace ode_parallel_sap
