// The machine, the build and the memory of this process.
#pragma once

#include <cstddef>
#include <string>

namespace bench {

struct Machine {
  std::string cpu;
  int cores = 0;  // that this process may use
  std::string gpu, driver;
  std::string compiler, flags, commit, date;
};
const Machine& machine();

// Bytes of this process in memory now, and at most since the last call of resetPeak.
std::size_t residentBytes();
std::size_t peakResidentBytes();
void resetPeak();
// Gives back to the system what was freed.
void trimHeap();

}  // namespace bench
