// How much memory the machine has to spare.
#pragma once

#include <cstdint>

namespace ode_parallel_sap {

// Bytes that can be taken without another program giving any up: what Linux calls available, or
// free pages where that is not told. Takes some ten microseconds.
std::uint64_t freeMemory();

}  // namespace ode_parallel_sap
