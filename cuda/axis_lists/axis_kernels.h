// The pairs common to all three axes, on the device.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "cuda/device/device.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {
namespace device {

// AxisRows (space/paper/endpoint_lists.h) of `count` boxes, and the list of the axis's pairs: of
// the pairs [first, last) the later box.
struct AxisView {
  const std::uint32_t *order, *ranks, *reach;
  const std::uint64_t* begins;
  std::uint32_t* list;
  unsigned long long first, last;
  std::uint32_t count;
  bool inverted;
};

// How many pairs the first two axes have in common, and how many all three.
struct CommonCounts {
  unsigned long long both, all;
};
struct CommonPairs {
  Pair *both, *all;
  CommonCounts* counts;
};

// Writes the list of an axis.
void fillList(const AxisView& axis, cudaStream_t stream);

// Places in the list of an axis.
struct Places {
  unsigned long long begin, end;
};

// The axes from the fullest on.
struct AxisViews {
  const AxisView &first, &second, &third;
};

// Of the pairs at `places` of the first axis, within its list: those that the second holds to
// `both`, and those of them that the third does to `all`, in no particular order. Both have room
// for as many.
void findCommon(const AxisViews& axes, const Places& places, const CommonPairs& found,
                const KernelQueue& queue);

}  // namespace device
}  // namespace ode_parallel_sap
