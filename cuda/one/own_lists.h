// Where several devices share a scene: which lists are a device's own.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/device/device.h"
#include "cuda/one/scene_plan.h"

namespace ode_parallel_sap {
namespace device {

// Pairs of each earlier slot, as each part has counted them.
struct PartCounts {
  const std::uint32_t* of[most_parts];
  std::uint32_t parts;
  std::size_t slots;
};

// sums[i] = what all parts have counted of slot i; sums[slots] = 0.
void addCounts(const PartCounts& counts, std::uint32_t* sums, const KernelQueue& queue);

// Where the lists of all parts begin (scanCounts), and how many pairs are in each.
struct AllLists {
  unsigned long long* begins;
  std::uint32_t* sums;
  std::size_t slots;
};

// Says in the plan which slots are the part's own (firstSlotOf), and makes of all lists these: the
// others become empty.
void keepOwnLists(const AllLists& lists, const Part& part, ScenePlan* plan,
                  const KernelQueue& queue);

}  // namespace device
}  // namespace ode_parallel_sap
