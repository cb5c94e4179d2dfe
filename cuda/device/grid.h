// How many blocks a kernel gets.
#pragma once

#include <cstddef>

#include "cuda/device/device.h"
#include "cuda/device/tuning.h"

namespace ode_parallel_sap {
namespace device {

// Blocks whose threads take items one by one.
inline std::size_t blocksForAll(std::size_t items) {
  return (items + block_threads - 1) / block_threads;
}

// Blocks that take items in strides, each `items_a_block` at least.
inline std::size_t blocksFor(std::size_t items, std::size_t items_a_block,
                             const KernelQueue& queue) {
  const std::size_t blocks = (items + items_a_block - 1) / items_a_block;
  const std::size_t most = std::size_t(queue.processors) * blocks_a_processor;
  return blocks < 1 ? 1 : blocks < most ? blocks : most;
}
inline std::size_t blocksFor(std::size_t items, const KernelQueue& queue) {
  return blocksFor(items, block_threads * items_a_thread, queue);
}

}  // namespace device
}  // namespace ode_parallel_sap
