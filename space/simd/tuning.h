// The tuned constants of the inner loops.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// Nodes or cells that are gathered before what is in them is read: they stay in the nearest
// cache.
constexpr std::size_t gathered_nodes = 256;

// Cells whose boxes are prefetched before they are packed.
constexpr std::size_t packed_ahead = 3;

}  // namespace ode_parallel_sap
