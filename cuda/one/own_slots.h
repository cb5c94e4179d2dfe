// Which slots' lists are a device's own, where several share a scene. For kernels and host.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/one/scene_plan.h"
#include "space/base/both_sides.h"

namespace ode_parallel_sap {
namespace device {

// The first slot of part `index` of `count`; the number of slots for the part after the last. From
// where the lists of all parts begin (scanCounts): a part begins with the first block of list_block
// slots ahead of which the parts before have their pairs, the same number for all.
ODE_PARALLEL_SAP_BOTH_SIDES inline std::uint32_t firstSlotOf(std::uint32_t index,
                                                             std::uint32_t count,
                                                             const unsigned long long* begins,
                                                             std::size_t slots) {
  if (index == count) return static_cast<std::uint32_t>(slots);
  const unsigned long long ahead = begins[slots] / count * index;
  std::size_t low = 0, high = slots / list_block;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (begins[middle * list_block] < ahead)
      low = middle + 1;
    else
      high = middle;
  }
  return static_cast<std::uint32_t>(low * list_block);
}

}  // namespace device
}  // namespace ode_parallel_sap
