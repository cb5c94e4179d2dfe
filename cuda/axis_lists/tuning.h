// The tuned constants of the paper's lists on devices.
#ifndef ODE_PARALLEL_SAP_CUDA_AXIS_LISTS_TUNING_H
#define ODE_PARALLEL_SAP_CUDA_AXIS_LISTS_TUNING_H

#include <cstdint>

namespace ode_parallel_sap {
namespace device {

// Pairs of an axis that a thread looks up: what a block found goes out together, from 16 kB of
// shared memory.
// Unit: pairs. From: cuda/check axis.
// Doubled: not measured. Halved: not measured.
constexpr int pairs_a_thread = 8;

// Pairs of the fullest axis that are dealt with at a time: bounds what their results may take.
// Unit: pairs. From: 256 MB of device memory.
// Doubled: not measured. Halved: not measured.
constexpr std::uint64_t axis_chunk_pairs = std::uint64_t{1} << 24;

}  // namespace device
}  // namespace ode_parallel_sap

#endif
