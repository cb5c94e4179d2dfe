#include "cuda/one/cells.h"
//
#include <thrust/iterator/counting_iterator.h>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_select.cuh>

#include "cuda/one/cell_cut.h"
#include "cuda/one/primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

constexpr int pack_threads = fan_out * 32;
constexpr int level_threads = 1024;  // fixed: as many as a block may have

// One thread a place: whether a cell begins there. Keys are read within [0, plan->active) only.
template <class Key>
__global__ void __launch_bounds__(block_threads)
    cutKernel(const Key* keys, std::size_t count, ScenePlan* plan, std::uint8_t* flags) {
  const std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x;
  if (i >= count) return;
  const CellCut cut = i < plan->active ? cellCutAt(keys, plan->active, i) : CellCut{false, false};
  if (cut.cluster) plan->counters.clustered = 1;
  flags[i] = cut.begins;
}

// One block a node of level 1, one warp a cell, one lane a box. Places are below plan->active, as
// starts are ascending and the last cell ends there; slots are below the number of boxes.
__global__ void __launch_bounds__(pack_threads)
    packKernel(OrderedBoxes boxes, const std::uint32_t* starts, const ScenePlan* plan,
               Records sorted, Levels levels) {
  __shared__ Record bounds[fan_out];
  const std::uint32_t cell_count = plan->counters.cells, active = plan->active;
  const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  for (std::uint32_t parent = blockIdx.x; parent * fan_out < cell_count; parent += gridDim.x) {
    const std::uint32_t cell = parent * fan_out + warp;
    if (cell < cell_count) {
      const std::uint32_t start = starts[cell];
      const std::uint32_t end = cell + 1 < cell_count ? starts[cell + 1] : active;
      const bool used = lane < end - start;
      Record box = {};
      if (used) {
        const std::uint32_t slot = boxes.slots[start + lane];
        box = loadBox(boxes.boxes, slot);
        box.low.w = __uint_as_float(slot);
        sorted.put(start + lane, box);
      }
      Record all = warpBounds(box, used);
      all.low.w = __uint_as_float(start);
      all.high.w = __uint_as_float(end - start);
      if (lane == 0) {
        levels.at[0].put(cell, all);
        bounds[warp] = all;
      }
    }
    __syncthreads();
    if (warp == 0) {
      const bool used = parent * fan_out + lane < cell_count;
      const Record all = warpBounds(bounds[lane], used);
      if (lane == 0) levels.at[1].put(parent, all);
    }
    __syncthreads();
  }
}

// One block, one warp a node: the levels above the first. Records are read below the number of
// their level only.
__global__ void __launch_bounds__(level_threads) levelKernel(const ScenePlan* plan, Levels levels) {
  const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  std::uint32_t children = (plan->counters.cells + fan_out - 1) / fan_out;
  for (int level = 2; level < most_levels && children > fan_out; ++level) {
    const std::uint32_t nodes = (children + fan_out - 1) / fan_out;
    for (std::uint32_t node = warp; node < nodes; node += level_threads / 32) {
      const std::uint32_t child = node * fan_out + lane;
      const bool used = child < children;
      const Record own = used ? levels.at[level - 1][child] : Record{};
      const Record all = warpBounds(own, used);
      if (lane == 0) levels.at[level].put(node, all);
    }
    __syncthreads();
    children = nodes;
  }
}

}  // namespace

TreeLayout::TreeLayout(std::size_t most) : records(0) {
  for (int level = 0; level < most_levels; ++level) {
    begin[level] = records;
    records += most;
    most = (most + fan_out - 1) / fan_out;
  }
}

template <class Key>
void sortByKey(const KeyedSlots<Key>& from, const KeyedSlots<Key>& to, std::size_t count,
               const ScratchQueue& queue) {
  constexpr int bits = sizeof(Key) * 8;
  const int first_bit = sizeof(Key) == 4 ? bits - keyDigitsFor(count) : 0;
  const auto sort = [&](void* scratch, std::size_t& bytes) {
    CHECK_CUDA(cub::DeviceRadixSort::SortPairs(scratch, bytes, from.keys, to.keys, from.slots,
                                               to.slots, static_cast<std::int64_t>(count),
                                               first_bit, bits, queue.stream));
  };
  withScratch(queue, sort);
}
template void sortByKey(const KeyedSlots<std::uint32_t>&, const KeyedSlots<std::uint32_t>&,
                        std::size_t, const ScratchQueue&);
template void sortByKey(const KeyedSlots<std::uint64_t>&, const KeyedSlots<std::uint64_t>&,
                        std::size_t, const ScratchQueue&);

template <class Key>
void cutCells(const Key* keys, std::size_t count, ScenePlan* plan, std::uint8_t* flags,
              std::uint32_t* starts, const ScratchQueue& queue) {
  launch("cut cells", cutKernel<Key>, blocksForAll(count), block_threads, queue.stream, keys, count,
         plan, flags);
  const thrust::counting_iterator<std::uint32_t> places(0);
  const auto select = [&](void* scratch, std::size_t& bytes) {
    CHECK_CUDA(cub::DeviceSelect::Flagged(scratch, bytes, places, flags, starts,
                                          &plan->counters.cells, static_cast<std::int64_t>(count),
                                          queue.stream));
  };
  withScratch(queue, select);
}
template void cutCells(const std::uint32_t*, std::size_t, ScenePlan*, std::uint8_t*, std::uint32_t*,
                       const ScratchQueue&);
template void cutCells(const std::uint64_t*, std::size_t, ScenePlan*, std::uint8_t*, std::uint32_t*,
                       const ScratchQueue&);

void packCells(const OrderedBoxes& boxes, const std::uint32_t* starts, const ScenePlan* plan,
               const CellStore& to, const KernelQueue& queue) {
  const Levels levels(to);
  // About what cells of half their size make; the blocks take further nodes in strides.
  launch("pack cells", packKernel, blocksFor(boxes.count, fan_out * cell_size / 2, queue),
         pack_threads, queue.stream, boxes, starts, plan, recordsIn(to.sorted, boxes.count),
         levels);
  launch("build levels", levelKernel, 1, level_threads, queue.stream, plan, levels);
}

}  // namespace device
}  // namespace ode_parallel_sap
