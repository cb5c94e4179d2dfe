// First stages on the device: classes of like size and shape, and each box's key; clusters.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "cuda/device/device.h"
#include "cuda/one/scene_plan.h"

namespace ode_parallel_sap {
namespace device {

// Empties what the stages count in `plan`.
void clearPlan(ScenePlan* plan, cudaStream_t stream);
// Only what the search counts; and that there are clusters, if they are to be ignored.
void clearSearch(ScenePlan* plan, bool ignore_clusters, cudaStream_t stream);

// Counts boxes [begin, end) by bin, and copies those of `from` to `boxes` unless they are there.
// All are 24-byte boxes.
void survey(const float* from, std::size_t begin, std::size_t end, float* boxes, ScenePlan* plan,
            const KernelQueue& queue);

// Once all boxes are counted: chooses the classes and gives each box its key. slots[i] = i.
void assignKeys(const float* boxes, std::size_t count, ScenePlan* plan, std::uint32_t* keys,
                std::uint32_t* slots, const KernelQueue& queue);

// Clusters are boxes that their keys do not tell apart, because others lie far away.
// Lays a curve of its own through each cluster of the boxes, whose keys are `keys`, and writes to
// new_keys what has to be sorted once more, by all bits. Returns whether any cluster can be told
// apart at all; waits for the device to know. The first time keys are of 32 bits, then of 64.
template <class Key>
bool divideClusters(const OrderedBoxes& boxes, const Key* keys, ScenePlan* plan,
                    std::uint64_t* new_keys, const ScratchQueue& queue);

}  // namespace device
}  // namespace ode_parallel_sap
