#include "cuda/one/own_lists.h"
//
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

// The first slot of part `index` of `count`; the number of slots for the part after the last. From
// where the lists of all parts begin (scanCounts): a part begins with the first block of list_block
// slots ahead of which the parts before have their pairs, the same number for all.
__device__ std::uint32_t firstSlotOf(std::uint32_t index, std::uint32_t count,
                                     const unsigned long long* begins, std::size_t slots) {
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

// One thread.
__global__ void ownSlotsKernel(AllLists lists, Part part, ScenePlan* plan) {
  const std::uint32_t begin = firstSlotOf(part.index, part.count, lists.begins, lists.slots);
  const std::uint32_t end = firstSlotOf(part.index + 1, part.count, lists.begins, lists.slots);
  plan->counters.own = {begin, end};
  plan->own_pairs = {lists.begins[begin], lists.begins[end]};
}

// One thread a slot and one for the place behind them, in strides.
__global__ void __launch_bounds__(block_threads) keepKernel(AllLists lists, const ScenePlan* plan) {
  const SlotRange own = plan->counters.own;
  const PairRange pairs = plan->own_pairs;
  const std::size_t stride = std::size_t{gridDim.x} * block_threads;
  for (std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x; i <= lists.slots;
       i += stride) {
    lists.begins[i] = min(max(lists.begins[i], pairs.begin), pairs.end) - pairs.begin;
    if (i < own.begin || i >= own.end) lists.sums[i] = 0;
  }
}

}  // namespace

void addCounts(const PartCounts& counts, std::uint32_t* sums, const KernelQueue& queue) {
  launch("add counts", addKernel, blocksForAll(counts.slots + 1), block_threads, queue.stream,
         counts, sums);
}

void keepOwnLists(const AllLists& lists, const Part& part, ScenePlan* plan,
                  const KernelQueue& queue) {
  launch("find own slots", ownSlotsKernel, 1, 1, queue.stream, lists, part, plan);
  launch("keep own lists", keepKernel, blocksFor(lists.slots + 1, queue), block_threads,
         queue.stream, lists, plan);
}

}  // namespace device
}  // namespace ode_parallel_sap
