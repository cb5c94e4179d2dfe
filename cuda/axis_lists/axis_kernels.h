// The pairs common to all three axes, on the device.
#ifndef ODE_PARALLEL_SAP_CUDA_AXIS_KERNELS_H
#define ODE_PARALLEL_SAP_CUDA_AXIS_KERNELS_H

#include <cuda_runtime_api.h>

#include <cstdint>

#include "space/data/pair_list.h"

namespace ode_parallel_sap {
namespace device {

// AxisRows (space/axes/endpoint_lists.h) of `count` boxes, and the list of the axis's pairs: of the
// pairs [first, last) the later box.
struct AxisView {
  const std::uint32_t *order, *ranks, *reach;
  const unsigned long long* begins;
  std::uint32_t* list;
  unsigned long long first, last;
  std::uint32_t count;
  bool inverted;
};

// How many pairs the first two axes have in common, and how many all three.
struct CommonCounts {
  unsigned long long both, all;
};

// Writes the list of an axis.
void fillList(const AxisView& axis, cudaStream_t stream);

// Of the pairs [begin, end) of `first`, within its list: those that `second` holds to `both`, and
// those of them that `third` holds to `all`, in no particular order. Both have room for end - begin
// pairs.
void findCommon(const AxisView& first, const AxisView& second, const AxisView& third,
                unsigned long long begin, unsigned long long end, Pair* both, Pair* all,
                CommonCounts* counts, int processors, cudaStream_t stream);

}  // namespace device
}  // namespace ode_parallel_sap

#endif
