#include "cuda/one/own_lists.h"
//
#include "cuda/one/own_slots.h"
#include "cuda/one/primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

// One thread a slot, and one for the place behind them.
__global__ void __launch_bounds__(block_threads) addKernel(PartCounts counts, std::uint32_t* sums) {
  const std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x;
  if (i > counts.slots) return;
  std::uint32_t sum = 0;
  if (i < counts.slots)
    for (std::uint32_t part = 0; part < counts.parts; ++part) sum += counts.of[part][i];
  sums[i] = sum;
}

// One thread a slot, in strides; each block finds the range for itself.
__global__ void __launch_bounds__(block_threads)
    keepKernel(const unsigned long long* ends, std::size_t slots, Part part, ScenePlan* plan,
               std::uint32_t* sums) {
  __shared__ std::uint32_t bounds[2];
  if (threadIdx.x < 2)
    bounds[threadIdx.x] = firstSlotOf(part.index + threadIdx.x, part.count, ends, slots);
  __syncthreads();
  if (blockIdx.x == 0 && threadIdx.x == 0) plan->own = {bounds[0], bounds[1]};
  const std::size_t stride = std::size_t{gridDim.x} * block_threads;
  for (std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x; i < slots;
       i += stride)
    if (i < bounds[0] || i >= bounds[1]) sums[i] = 0;
}

}  // namespace

void addCounts(const PartCounts& counts, std::uint32_t* sums, const KernelQueue& queue) {
  launch("add counts", addKernel, blocksForAll(counts.slots + 1), block_threads, queue.stream,
         counts, sums);
}

void keepOwnCounts(const unsigned long long* ends, std::size_t slots, const Part& part,
                   ScenePlan* plan, std::uint32_t* sums, const KernelQueue& queue) {
  launch("keep own counts", keepKernel, blocksFor(slots, queue), block_threads, queue.stream, ends,
         slots, part, plan, sums);
}

}  // namespace device
}  // namespace ode_parallel_sap
