#include "cuda/one/lists.h"
//
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "cuda/one/primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

struct Add {
  __device__ unsigned long long operator()(unsigned long long a, unsigned long long b) const {
    return a + b;
  }
};

// Writes word `i` of all lists to the segments, and the header if it is a segment's first.
struct ToSegments {
  std::uint32_t* segments;
  __device__ void operator()(unsigned long long i, std::uint32_t word, std::uint32_t ahead,
                             std::uint32_t slot) const {
    segments[i + (i / segment_words + 1) * header_words] = word | ahead << ahead_shift;
    if (i % segment_words == 0)
      *reinterpret_cast<uint4*>(segments + i / segment_words * segment_size) =
          make_uint4(slot, 0, 0, 0);
  }
};
// Writes it as a pair.
struct ToPairs {
  SortedPairs to;
  __device__ void operator()(unsigned long long i, std::uint32_t word, std::uint32_t,
                             std::uint32_t slot) const {
    to.pairs[i] = Found{word & 1} << 63 | Found{slot} << 32 | word >> 1;
    if (word & 1) to.borderline[i / segment_words] = 1;
  }
};

// One thread a slot, one block list_block slots. The last block's last threads have no slot;
// block_begins has a place for each block and one more, has_list one for each 32 slots.
__global__ void __launch_bounds__(list_block)
    summariseKernel(const std::uint32_t* counts, const unsigned long long* ends, std::size_t slots,
                    ScenePlan* plan, ListSummary summary) {
  const std::size_t slot = std::size_t{blockIdx.x} * list_block + threadIdx.x;
  if (threadIdx.x == 0) summary.block_begins[blockIdx.x] = ends[slot];
  const std::uint32_t count = slot < slots ? counts[slot] : 0;
  const unsigned lists = __ballot_sync(all_lanes, count != 0);
  if (threadIdx.x % 32 == 0 && slot < slots) summary.has_list[slot / 32] = lists;
  if (count > long_list) {
    summary.long_slots[atomicAdd(&plan->counters.long_lists, 1u)] =
        static_cast<std::uint32_t>(slot);
    atomicAdd(&plan->counters.long_words, static_cast<unsigned long long>(count));
  }
  if (blockIdx.x == gridDim.x - 1 && threadIdx.x == 0)
    summary.block_begins[gridDim.x] = ends[slots];
}

// One thread a place of `found`, in strides of whole warps. Pairs of one slot in a row take their
// places in its list at once. These are whatever the counter gives: below the list's end, as the
// list has one place for each pair found. Pairs of slots outside the range are taken for none. It
// is plan->own, and all places are filled, if only_own.
template <bool only_own>
__global__ void __launch_bounds__(block_threads)
    scatterKernel(const Found* __restrict__ found, unsigned long long capacity, SlotRange range,
                  const ScenePlan* plan, unsigned long long* ends, std::uint32_t* lists) {
  const unsigned long long count = only_own ? capacity : plan->counters.found;
  if (count > capacity) return;
  if (only_own) range = plan->own;
  const int lane = threadIdx.x % 32;
  const unsigned long long stride = std::size_t{gridDim.x} * block_threads;
  for (unsigned long long first = blockIdx.x * std::size_t{block_threads} + threadIdx.x - lane;
       first < count; first += stride) {
    Found pair = first + lane < count ? found[first + lane] : nothing_found;
    const std::uint32_t earlier = static_cast<std::uint32_t>(pair >> 32);
    if (!(earlier >= range.begin && earlier < range.end)) pair = nothing_found;
    if (!__any_sync(all_lanes, pair != nothing_found)) continue;
    const std::uint32_t before = __shfl_up_sync(all_lanes, earlier, 1);
    const unsigned heads = __ballot_sync(all_lanes, lane == 0 || before != earlier);
    const int head = 31 - __clz(static_cast<int>(heads & (all_lanes >> (31 - lane))));
    const unsigned later_heads = lane == 31 ? 0 : heads >> (lane + 1);
    const int length = later_heads ? __ffs(later_heads) : 32 - lane;  // of a head's row
    unsigned long long place = 0;
    if (head == lane && pair != nothing_found)
      place = atomicAdd(&ends[earlier], static_cast<unsigned long long>(length));
    place = __shfl_sync(all_lanes, place, head) + (lane - head);
    if (pair != nothing_found) lists[place] = static_cast<std::uint32_t>(pair);
  }
}

// The lists of one block of slots. Long ones count as empty in `short_begins`.
struct BlockLists {
  unsigned long long begins[list_block];
  std::uint32_t short_begins[list_block + 1];
  std::uint32_t has_list[list_block / 32], warp_sums[list_block / 32];
  std::uint8_t ahead[list_block];
};

// The last list that begins at or before word i of a block's short lists.
__device__ int listOf(const BlockLists& block, std::uint32_t i) {
  int low = 0, high = list_block - 1;
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    if (block.short_begins[middle] <= i)
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

// Puts each word of a block's short lists where the number of lesser words in its list says. Word i
// of all is of the list at place listAt(i), whose word k is wordOf(place, k).
template <class ListAt, class WordOf, class Write>
__device__ void rankWords(ListAt listAt, WordOf wordOf, const BlockLists& block,
                          std::size_t first_slot, Write write) {
  const std::uint32_t count = block.short_begins[list_block];
  for (std::uint32_t i = threadIdx.x; i < count; i += list_block) {
    const int low = listAt(i);
    const std::uint32_t begin = block.short_begins[low];
    const std::uint32_t length = block.short_begins[low + 1] - begin, own = wordOf(low, i - begin);
    std::uint32_t rank = 0;
    for (std::uint32_t k = 0; k < length; ++k) rank += wordOf(low, k) < own;
    write(block.begins[low] + rank, own, rank == 0 ? block.ahead[low] : 0,
          static_cast<std::uint32_t>(first_slot + low));
  }
}

static_assert(list_block <= 256, "a byte tells a list of a block");

// One block list_block slots, one thread a word of their short lists, in strides. The words of a
// list differ, so that their ranks do; a rank is below the list's length. Short lists of a block
// have at most list_block * long_list words.
template <class Write>
__global__ void __launch_bounds__(list_block)
    sortKernel(Lists of, std::size_t first_block, Write write) {
  __shared__ BlockLists block;
  __shared__ std::uint32_t cached[cached_words];
  __shared__ std::uint8_t list_at[cached_words];  // of each cached word
  if (of.plan->counters.found > of.capacity) return;
  const std::uint32_t* const __restrict__ lists = of.words;
  const unsigned long long* const ends = of.ends;
  const std::size_t slots = of.slots;
  const int t = threadIdx.x, lane = t % 32, warp = t / 32;
  const std::size_t first = (first_block + blockIdx.x) * list_block, slot = first + t;
  const unsigned long long begin = slot == 0 ? 0 : ends[min(slot, slots) - 1];
  const unsigned long long end = slot < slots ? ends[slot] : begin;
  const std::uint32_t length =
      end - begin > long_list ? 0 : static_cast<std::uint32_t>(end - begin);
  const unsigned with_list = __ballot_sync(all_lanes, begin < end);
  std::uint32_t sum = length;
  for (int step = 1; step < 32; step *= 2) {
    const std::uint32_t below = __shfl_up_sync(all_lanes, sum, step);
    if (lane >= step) sum += below;
  }
  block.begins[t] = begin;
  if (lane == 31) block.warp_sums[warp] = sum;
  if (lane == 0) block.has_list[warp] = with_list;
  __syncthreads();
  for (int i = 0; i < warp; ++i) sum += block.warp_sums[i];
  block.short_begins[t + 1] = sum;
  if (t == 0) block.short_begins[0] = 0;
  // The slot before in this block that has a list.
  unsigned before = with_list & ((1u << lane) - 1);
  int from = warp;
  while (!before && from > 0) before = block.has_list[--from];
  const int ahead = before ? t - (from * 32 + 31 - __clz(static_cast<int>(before))) : far_ahead;
  block.ahead[t] = static_cast<std::uint8_t>(min(ahead, static_cast<int>(far_ahead)));
  __syncthreads();
  const unsigned long long base = block.begins[0];
  const std::uint32_t count = block.short_begins[list_block];
  // Without a long list among them the words of a block are in a row.
  const bool in_a_row = !__syncthreads_or(end - begin > long_list);
  if (in_a_row && count <= cached_words) {
    for (std::uint32_t i = t; i < count; i += list_block) cached[i] = lists[base + i];
    for (std::uint32_t i = sum - length; i < sum; ++i) list_at[i] = static_cast<std::uint8_t>(t);
    __syncthreads();
    rankWords([&](std::uint32_t i) { return list_at[i]; },
              [&](int list, std::uint32_t k) { return cached[block.short_begins[list] + k]; },
              block, first, write);
  } else {
    rankWords([&](std::uint32_t i) { return listOf(block, i); },
              [&](int list, std::uint32_t k) { return lists[block.begins[list] + k]; }, block,
              first, write);
  }
}

// Where the words of the long lists lie, list after list. Their keys: the list's number above the
// word.
struct LongWords {
  const std::uint32_t* slots;         // of each list
  const unsigned long long* begins;   // of each, among the words of all lists
  const unsigned long long* offsets;  // of each, among those of the long ones
  std::uint32_t count;
  unsigned long long words;
  int word_bits;
};

// One thread a long list: where it begins, and its length, from which a scan makes offsets.
__global__ void __launch_bounds__(block_threads)
    longListKernel(const unsigned long long* ends, LongLists lists, unsigned long long* begins,
                   unsigned long long* lengths) {
  const std::uint32_t i = blockIdx.x * block_threads + threadIdx.x;
  if (i >= lists.count) return;
  const std::uint32_t slot = lists.slots[i];
  begins[i] = slot ? ends[slot - 1] : 0;
  lengths[i] = ends[slot] - begins[i];
}

// One thread a word of the long lists, in strides.
__global__ void __launch_bounds__(block_threads)
    gatherKernel(const std::uint32_t* lists, LongWords from, std::uint64_t* keys) {
  const unsigned long long stride = std::size_t{gridDim.x} * block_threads;
  for (unsigned long long i = blockIdx.x * std::size_t{block_threads} + threadIdx.x; i < from.words;
       i += stride) {
    std::uint32_t low = 0, high = from.count - 1;  // the last list whose offset is at or before i
    while (low < high) {
      const std::uint32_t middle = low + (high - low + 1) / 2;
      if (from.offsets[middle] <= i)
        low = middle;
      else
        high = middle - 1;
    }
    keys[i] =
        std::uint64_t{low} << from.word_bits | lists[from.begins[low] + (i - from.offsets[low])];
  }
}

// The way back, once the keys are sorted: list follows list as before.
template <class Write>
__global__ void __launch_bounds__(block_threads)
    spreadKernel(const std::uint64_t* keys, LongWords from, Write write) {
  const unsigned long long stride = std::size_t{gridDim.x} * block_threads;
  for (unsigned long long i = blockIdx.x * std::size_t{block_threads} + threadIdx.x; i < from.words;
       i += stride) {
    const std::uint32_t list = static_cast<std::uint32_t>(keys[i] >> from.word_bits);
    const std::uint32_t word = static_cast<std::uint32_t>(keys[i]) & ((1u << from.word_bits) - 1);
    const unsigned long long rank = i - from.offsets[list];
    write(from.begins[list] + rank, word, rank == 0 ? far_ahead : 0, from.slots[list]);
  }
}

template <class In>
void scan(const In* values, unsigned long long* sums, std::size_t count,
          const ScratchQueue& queue) {
  std::size_t bytes = 0;
  const auto size = static_cast<std::int64_t>(count);
  CHECK_CUDA(cub::DeviceScan::ExclusiveScan(nullptr, bytes, values, sums, Add(), 0ull, size,
                                            queue.stream));
  queue.scratch.reserve(bytes);
  CHECK_CUDA(cub::DeviceScan::ExclusiveScan(queue.scratch.data(), bytes, values, sums, Add(), 0ull,
                                            size, queue.stream));
}

// Returns which of the two has the result.
const std::uint64_t* sortKeys(DeviceBuffer<std::uint64_t> (&buffers)[2], unsigned long long count,
                              int bits, const ScratchQueue& queue) {
  cub::DoubleBuffer<std::uint64_t> keys(buffers[0].data(), buffers[1].data());
  const auto size = static_cast<std::int64_t>(count);
  std::size_t bytes = 0;
  CHECK_CUDA(cub::DeviceRadixSort::SortKeys(nullptr, bytes, keys, size, 0, bits, queue.stream));
  queue.scratch.reserve(bytes);
  CHECK_CUDA(cub::DeviceRadixSort::SortKeys(queue.scratch.data(), bytes, keys, size, 0, bits,
                                            queue.stream));
  return keys.Current();
}

int bitsFor(std::uint64_t values) {
  int bits = 0;
  while (bits < 64 && values >> bits) ++bits;
  return bits;
}

}  // namespace

void scanCounts(const std::uint32_t* counts, unsigned long long* ends, std::size_t slots,
                const ScratchQueue& queue) {
  scan(counts, ends, slots + 1, queue);
}

void summariseLists(const std::uint32_t* counts, const unsigned long long* ends, std::size_t slots,
                    ScenePlan* plan, const ListSummary& summary, const KernelQueue& queue) {
  launch("summarise lists", summariseKernel, (slots + list_block - 1) / list_block, list_block,
         queue.stream, counts, ends, slots, plan, summary);
}

void scatterPairs(const FoundPairs& found, const SlotRange& range, const ScenePlan* plan,
                  unsigned long long* ends, std::uint32_t* lists, const KernelQueue& queue) {
  launch("scatter pairs", scatterKernel<false>, std::size_t(queue.processors) * blocks_a_processor,
         block_threads, queue.stream, found.pairs, found.capacity, range, plan, ends, lists);
}

void scatterOwnPairs(const Found* found, std::size_t count, const ScenePlan* plan,
                     unsigned long long* ends, std::uint32_t* lists, const KernelQueue& queue) {
  launch("scatter own pairs", scatterKernel<true>,
         std::size_t(queue.processors) * blocks_a_processor, block_threads, queue.stream, found,
         count, SlotRange{0, 0}, plan, ends, lists);
}

void sortLists(const Lists& lists, std::size_t begin, std::size_t end, const KernelQueue& queue) {
  const auto sort = [&](auto write) {
    launch("sort lists", sortKernel<decltype(write)>, end - begin, list_block, queue.stream, lists,
           begin, write);
  };
  if (begin == end) return;
  if (lists.to.segments)
    sort(ToSegments{lists.to.segments});
  else
    sort(ToPairs{lists.to.pairs});
}

void sortLongLists(const Lists& lists, const LongLists& long_lists, LongListStore& store,
                   const ScratchQueue& queue) {
  const std::uint32_t count = long_lists.count;
  store.begins.reserve(count);
  store.offsets.reserve(2 * std::size_t{count});
  for (DeviceBuffer<std::uint64_t>& keys : store.keys) keys.reserve(long_lists.words);
  unsigned long long* const lengths = store.offsets.data() + count;
  unsigned long long* const offsets = store.offsets.data();
  launch("find long lists", longListKernel, blocksForAll(count), block_threads, queue.stream,
         lists.ends, long_lists, store.begins.data(), lengths);
  scan(lengths, offsets, count, queue);
  const LongWords from = {long_lists.slots, store.begins.data(),         offsets, count,
                          long_lists.words, bitsFor(2 * lists.slots - 1)};
  const std::size_t blocks = blocksFor(from.words, queue);
  launch("gather long lists", gatherKernel, blocks, block_threads, queue.stream, lists.words, from,
         store.keys[0].data());
  const std::uint64_t* const sorted =
      sortKeys(store.keys, from.words, from.word_bits + bitsFor(count - 1), queue);
  const auto spread = [&](auto write) {
    launch("spread long lists", spreadKernel<decltype(write)>, blocks, block_threads, queue.stream,
           sorted, from, write);
  };
  if (lists.to.segments)
    spread(ToSegments{lists.to.segments});
  else
    spread(ToPairs{lists.to.pairs});
}

}  // namespace device
}  // namespace ode_parallel_sap
