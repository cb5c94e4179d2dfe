// The library's own counts of who had work: for programs built from its objects.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "space/base/parallel.h"

namespace sap_test {

// Sets the grain of the process as long as it lives.
class ScopedGrain {
 public:
  explicit ScopedGrain(std::uint64_t grain)
      : before_(ode_parallel_sap::test_grain.exchange(grain)) {}
  ~ScopedGrain() { ode_parallel_sap::test_grain = before_; }
  ScopedGrain(const ScopedGrain&) = delete;
  ScopedGrain& operator=(const ScopedGrain&) = delete;

 private:
  const std::uint64_t before_;
};

// How often two threads or more had work in each region of the program.
inline std::map<std::string, std::uint64_t> timesShared() {
  std::map<std::string, std::uint64_t> times;
  using ode_parallel_sap::Region;
  for (const Region* region = Region::first; region; region = region->next)
    times[region->name] = region->times_shared;
  return times;
}

// Regions of devices are those of the CUDA back end.
inline bool isOfDevice(const std::string& region) {
  return region.rfind("device: ", 0) == 0;
}

}  // namespace sap_test
