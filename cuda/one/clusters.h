// Clusters: boxes that their keys do not tell apart, because others lie far away.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "cuda/device/device.h"
#include "cuda/one/scene_plan.h"

namespace ode_parallel_sap {
namespace device {

// Lays a curve of its own through each cluster of the boxes, whose keys are `keys`, and writes to
// new_keys what has to be sorted once more, by all bits. Returns whether any cluster can be told
// apart at all; waits for the device to know. The first time keys are of 32 bits, then of 64.
template <class Key>
bool divideClusters(const OrderedBoxes& boxes, const Key* keys, ScenePlan* plan,
                    std::uint64_t* new_keys, const ScratchQueue& queue);

}  // namespace device
}  // namespace ode_parallel_sap
