// What the paper's lists throw where there is no memory for them.
#pragma once

#include <cstdint>
#include <stdexcept>

namespace ode_parallel_sap {

// The lists of a scene need more memory than they may take. Both in bytes.
class ListsTooLong : public std::runtime_error {
 public:
  ListsTooLong(std::uint64_t needed, std::uint64_t allowed)
      : std::runtime_error("the lists of pairs are too long"), needed(needed), allowed(allowed) {}
  std::uint64_t needed, allowed;
};

}  // namespace ode_parallel_sap
