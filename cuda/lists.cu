#include "lists.h"
//
#include <cub/device/device_scan.cuh>
#include <cub/device/device_segmented_sort.cuh>

#include "primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

constexpr int scatter_threads = 256;
constexpr int scatter_blocks_a_processor = 8;

// Words of a block's lists that are kept in shared memory while they are sorted, 16 kB; what has
// more is read from global memory.
constexpr std::uint32_t cached_words = 4096;

struct Add {
  __device__ unsigned long long operator()(unsigned long long a, unsigned long long b) const {
    return a + b;
  }
};

// One thread a slot, one block list_block slots. The last block's last threads have no slot;
// block_begins has a place for each block and one more.
__global__ void __launch_bounds__(list_block)
    summariseKernel(const std::uint32_t* counts, const unsigned long long* ends, std::size_t slots,
                    ScenePlan* plan, std::uint8_t* short_counts, unsigned long long* block_begins,
                    std::uint32_t* long_slots) {
  const std::size_t slot = std::size_t{blockIdx.x} * list_block + threadIdx.x;
  if (threadIdx.x == 0) block_begins[blockIdx.x] = ends[slot];
  const std::uint32_t count = slot < slots ? counts[slot] : 0;
  if (slot < slots) short_counts[slot] = static_cast<std::uint8_t>(min(count, 255u));
  if (count > long_list) long_slots[atomicAdd(&plan->counters.long_lists, 1u)] = slot;
  if (__any_sync(all_lanes, count >= 255)) {
    const int longest = warpMax(static_cast<int>(count));
    if (threadIdx.x % 32 == 0)
      atomicMax(&plan->counters.longest_list, static_cast<std::uint32_t>(longest));
  }
  if (blockIdx.x == gridDim.x - 1 && threadIdx.x == 0) block_begins[gridDim.x] = ends[slots];
}

// One thread a place of `found`, in strides. A pair's place in its list is whatever the counter
// gives: below the list's end, as the list has one place for each pair found.
__global__ void __launch_bounds__(scatter_threads)
    scatterKernel(const Found* __restrict__ found, unsigned long long capacity,
                  const ScenePlan* plan, unsigned long long* ends, std::uint32_t* lists) {
  const unsigned long long count = plan->counters.found;
  if (count > capacity) return;
  const unsigned long long stride = std::size_t{gridDim.x} * scatter_threads;
  unsigned long long i = blockIdx.x * std::size_t{scatter_threads} + threadIdx.x;
#pragma unroll 4
  for (; i < count; i += stride) {
    const Found pair = found[i];
    if (pair == nothing_found) continue;
    lists[atomicAdd(&ends[pair >> 32], 1ull)] = static_cast<std::uint32_t>(pair);
  }
}

// Puts each word of a block's lists where the number of lesser words in its list says.
template <class Words>
__device__ void rankWords(Words words, const unsigned long long* begins, unsigned long long count,
                          std::uint32_t* sorted) {
  for (unsigned long long i = threadIdx.x; i < count; i += list_block) {
    int low = 0, high = list_block - 1;  // the last list that begins at or before i
    while (low < high) {
      const int middle = (low + high + 1) / 2;
      if (begins[middle] <= i)
        low = middle;
      else
        high = middle - 1;
    }
    const unsigned long long begin = begins[low];
    const std::uint32_t length =
        static_cast<std::uint32_t>(min(begins[low + 1] - begin, 0xffffffffull));
    if (length > long_list) continue;
    const std::uint32_t own = words[i];
    std::uint32_t rank = 0;
    for (std::uint32_t k = 0; k < length; ++k) rank += words[begin + k] < own;
    sorted[begin + rank] = own;
  }
}

// One block list_block slots, one thread a word of their lists, in strides. The words of a list
// differ, so that their ranks do; a rank is below the list's length.
__global__ void __launch_bounds__(list_block)
    sortKernel(const std::uint32_t* __restrict__ lists, const unsigned long long* ends,
               std::size_t slots, std::size_t first_block, std::uint32_t* sorted) {
  __shared__ unsigned long long begins[list_block + 1];
  __shared__ std::uint32_t cached[cached_words];
  const std::size_t first = (first_block + blockIdx.x) * list_block;
  const std::size_t slot = first + threadIdx.x;
  const unsigned long long base = first ? ends[first - 1] : 0;
  begins[threadIdx.x + 1] = ends[slot < slots ? slot : slots - 1] - base;
  if (threadIdx.x == 0) begins[0] = 0;
  __syncthreads();
  const unsigned long long count = begins[list_block];
  if (count <= cached_words) {
    for (std::uint32_t i = threadIdx.x; i < count; i += list_block) cached[i] = lists[base + i];
    __syncthreads();
    rankWords(static_cast<const std::uint32_t*>(cached), begins, count, sorted + base);
  } else {
    rankWords(lists + base, begins, count, sorted + base);
  }
}

// One thread a long list.
__global__ void segmentKernel(const unsigned long long* ends, const std::uint32_t* long_slots,
                              std::uint32_t count, unsigned long long* begins,
                              unsigned long long* stops) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  const std::uint32_t slot = long_slots[i];
  begins[i] = slot ? ends[slot - 1] : 0;
  stops[i] = ends[slot];
}

}  // namespace

void scanCounts(const std::uint32_t* counts, unsigned long long* ends, std::size_t slots,
                DeviceBuffer<char>& scratch, cudaStream_t stream) {
  std::size_t bytes = 0;
  const auto count = static_cast<std::int64_t>(slots + 1);
  CHECK_CUDA(
      cub::DeviceScan::ExclusiveScan(nullptr, bytes, counts, ends, Add(), 0ull, count, stream));
  scratch.reserve(bytes);
  CHECK_CUDA(cub::DeviceScan::ExclusiveScan(scratch.data(), bytes, counts, ends, Add(), 0ull, count,
                                            stream));
}

void summariseLists(const std::uint32_t* counts, const unsigned long long* ends, std::size_t slots,
                    ScenePlan* plan, std::uint8_t* short_counts, unsigned long long* block_begins,
                    std::uint32_t* long_slots, cudaStream_t stream) {
  launch("summarise lists", summariseKernel, (slots + list_block - 1) / list_block, list_block,
         stream, counts, ends, slots, plan, short_counts, block_begins, long_slots);
}

void scatterPairs(const Found* found, unsigned long long capacity, const ScenePlan* plan,
                  unsigned long long* ends, std::uint32_t* lists, int processors,
                  cudaStream_t stream) {
  launch("scatter pairs", scatterKernel, std::size_t(processors) * scatter_blocks_a_processor,
         scatter_threads, stream, found, capacity, plan, ends, lists);
}

void sortLists(const std::uint32_t* lists, const unsigned long long* ends, std::size_t slots,
               std::size_t begin, std::size_t end, std::uint32_t* sorted, cudaStream_t stream) {
  if (begin < end)
    launch("sort lists", sortKernel, end - begin, list_block, stream, lists, ends, slots, begin,
           sorted);
}

void sortLongLists(const std::uint32_t* lists, const unsigned long long* ends,
                   const std::uint32_t* long_slots, std::uint32_t count, unsigned long long words,
                   unsigned long long* segments, std::uint32_t* sorted, DeviceBuffer<char>& scratch,
                   cudaStream_t stream) {
  constexpr int threads = 128;
  launch("find long lists", segmentKernel, (count + threads - 1) / threads, threads, stream, ends,
         long_slots, count, segments, segments + count);
  std::size_t bytes = 0;
  const auto size = static_cast<std::int64_t>(words);
  CHECK_CUDA(cub::DeviceSegmentedSort::SortKeys(nullptr, bytes, lists, sorted, size,
                                                static_cast<std::int64_t>(count), segments,
                                                segments + count, stream));
  scratch.reserve(bytes);
  CHECK_CUDA(cub::DeviceSegmentedSort::SortKeys(scratch.data(), bytes, lists, sorted, size,
                                                static_cast<std::int64_t>(count), segments,
                                                segments + count, stream));
}

}  // namespace device
}  // namespace ode_parallel_sap
