// The tuned constants of a scene that several devices share.
#ifndef ODE_PARALLEL_SAP_CUDA_SEVERAL_TUNING_H
#define ODE_PARALLEL_SAP_CUDA_SEVERAL_TUNING_H

#include <cstddef>

namespace ode_parallel_sap {
namespace device {

// Another axis is looked for when more of the sampled boxes than one in this many go to further
// shares.
// Unit: boxes. From: cuda/check devices, layer and line.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t few_copies = 32;

// Another axis is taken when it leaves less than this part of those copies.
// Unit: 1. From: cuda/check devices, layer and line.
// Doubled: no difference. Halved: no difference.
constexpr double clearly_fewer = 0.8;

// Pairs that take a device as long as a box does: a box travels and is sorted, a pair is found, put
// into its list and travels.
// Unit: pairs. From: tests/bench/results/DEVICES.md, H200.
// Doubled: no difference. Halved: no difference.
constexpr double pairs_of_a_box = 4;

// Pairs that a thread joins at a time: long enough that handing them out costs nothing, short
// enough to stay in a core's cache.
// Unit: pairs. From: cuda/check devices, cube of 1,000,000.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t slice_pairs = 1 << 15;

// So many pairs go past the caches, 64 MB: no use to whoever reads them next, and a fifth less time
// for 74 million.
// Unit: pairs. From: tests/bench/results/DEVICES.md.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t too_many_for_caches = std::size_t{1} << 23;

}  // namespace device
}  // namespace ode_parallel_sap

#endif
