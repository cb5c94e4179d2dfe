// The machine and the build.
#pragma once

#include <string>

namespace bench {

struct Machine {
  std::string cpu;
  int cores = 0;  // that this process may use
  std::string gpu, driver;
  std::string compiler, flags, commit, date;
};
const Machine& machine();

}  // namespace bench
