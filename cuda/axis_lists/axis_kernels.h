// The pairs common to all three axes, on the device.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "space/base/pair_list.h"

namespace ode_parallel_sap {
namespace device {

// AxisRows (space/paper/axis_lists.h) of `count` boxes, and the list of the axis's pairs: of
// the pairs [first, last) the later box.
struct AxisView {
  const std::uint32_t *order, *ranks, *reach;
  const std::uint64_t* begins;
  std::uint32_t* list;
  unsigned long long first, last;
  std::uint32_t count;
  bool inverted;
};

// Writes the list of an axis.
void fillList(const AxisView& axis, cudaStream_t stream);

// Places in the list of an axis.
struct Places {
  unsigned long long begin, end;
};

// The axes from the fullest on.
struct AxisViews {
  AxisView first, second, third;
};

// Writes to `found` those of the pairs at `places` of the first axis, within its list, that both
// others hold, in no particular order, and to `count` their number. There is room for all.
void findCommon(const AxisViews& axes, const Places& places, Pair* found, unsigned long long* count,
                cudaStream_t stream);

}  // namespace device
}  // namespace ode_parallel_sap
