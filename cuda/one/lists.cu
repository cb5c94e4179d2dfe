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

// Writes word `i` of all lists, which is of that slot, as a pair.
__device__ void writePair(const SortedPairs& to, unsigned long long i, std::uint32_t word,
                          std::uint32_t slot) {
  to.pairs[i] = Found{word & 1} << 63 | Found{slot} << 32 | word >> 1;
  if (word & 1) to.borderline[i / segment_pairs] = 1;
}

// One thread a slot, one block list_block slots. The last block's last threads have no slot. Notes
// the long lists, those of a block at once, as all blocks meet at one counter, for which there is a
// place for each slot. It counts lists and words in one, so that both ascend together; of more
// words than it tells no lists are made.
__global__ void __launch_bounds__(list_block)
    summariseKernel(const std::uint32_t* counts, const unsigned long long* begins,
                    std::size_t slots, ScenePlan* plan, LongSlots to) {
  __shared__ unsigned long long all;
  const std::size_t slot = std::size_t{blockIdx.x} * list_block + threadIdx.x;
  const unsigned long long pairs = begins[slots];
  if (slot == 0) plan->counters.pairs = pairs;
  const std::uint32_t count = slot < slots ? counts[slot] : 0;
  const bool is_long = count > long_list && pairs <= most_long_words;
  if (threadIdx.x == 0) all = 0;
  if (!__syncthreads_or(is_long)) return;
  unsigned long long place = 0;
  if (is_long) place = atomicAdd(&all, one_long_list | count);
  __syncthreads();
  if (threadIdx.x == 0) all = atomicAdd(&plan->counters.long_lists, all);
  __syncthreads();
  if (!is_long) return;
  place += all;
  to.slots[place / one_long_list] = static_cast<std::uint32_t>(slot);
  to.offsets[place / one_long_list] = place & most_long_words;
}

// One thread a place of `found`, in strides of whole warps. Pairs of one slot in a row take their
// places in its list at once, from those that are left: the last ones first, as many as there are
// pairs beyond the slot's rows. Where only_own, those of slots outside of the device's own are
// none, and all places are filled. A place is below the list's end, as one is left for each pair
// beyond the rows when the first one comes, and not before the rows' end.
template <bool only_own>
__global__ void __launch_bounds__(block_threads)
    scatterKernel(const Found* __restrict__ found, unsigned long long capacity,
                  const ScenePlan* plan, OpenLists to) {
  const unsigned long long count = only_own ? capacity : plan->counters.found;
  if (count > capacity || to.begins[to.slots] > to.capacity) return;
  const SlotRange own = plan->counters.own;
  const int lane = threadIdx.x % 32;
  const unsigned long long stride = std::size_t{gridDim.x} * block_threads;
  for (unsigned long long first = blockIdx.x * std::size_t{block_threads} + threadIdx.x - lane;
       first < count; first += stride) {
    Found pair = first + lane < count ? found[first + lane] : nothing_found;
    const std::uint32_t earlier = static_cast<std::uint32_t>(pair >> 32);
    if (only_own && !(earlier >= own.begin && earlier < own.end)) pair = nothing_found;
    if (!__any_sync(all_lanes, pair != nothing_found)) continue;
    const std::uint32_t before = __shfl_up_sync(all_lanes, earlier, 1);
    const unsigned heads = __ballot_sync(all_lanes, lane == 0 || before != earlier);
    const int head = 31 - __clz(static_cast<int>(heads & (all_lanes >> (31 - lane))));
    const unsigned later_heads = lane == 31 ? 0 : heads >> (lane + 1);
    const int length = later_heads ? __ffs(later_heads) : 32 - lane;  // of a head's row
    std::uint32_t left = 0;
    if (head == lane && pair != nothing_found) left = atomicSub(&to.left[earlier], length);
    left = __shfl_sync(all_lanes, left, head) - (lane - head);
    if (pair != nothing_found)
      to.words[to.begins[earlier] + left - 1] = static_cast<std::uint32_t>(pair);
  }
}

// The row of a slot in a part's rows; whole lines of 16 bytes.
__device__ const std::uint32_t* rowOf(const ListRows& rows, std::uint32_t part, std::size_t slot) {
  return rows.of[part].words + slot * rows.length;
}

// Words of a slot in a part's row, where there are several parts.
__device__ std::uint32_t rowCount(const ListRows& rows, std::uint32_t part, std::size_t slot) {
  return min(rows.of[part].counts[slot], rows.length);
}

// Word k of the list of a slot, which begins at `begin`.
__device__ std::uint32_t wordAt(const Lists& of, std::size_t slot, unsigned long long begin,
                                unsigned long long k) {
  if (of.rows.parts == 1)
    return k < of.rows.length ? rowOf(of.rows, 0, slot)[k] : of.words[begin + k];
  unsigned long long before = 0;
  for (std::uint32_t part = 0; part < of.rows.parts; ++part) {
    const std::uint32_t count = rowCount(of.rows, part, slot);
    if (k < before + count) return rowOf(of.rows, part, slot)[k - before];
    before += count;
  }
  return of.words[begin + k];
}

constexpr std::uint32_t no_word = ~std::uint32_t{0};  // behind all words

__device__ void putInOrder(std::uint32_t& a, std::uint32_t& b) {
  const std::uint32_t lesser = min(a, b);
  b = max(a, b);
  a = lesser;
}

// Batcher's odd-even merge sort, all of it in registers: templates, as the compiler does not unroll
// loops whose ways are halved. Merges every way-th of `count` words from `first` on.
template <int first, int count, int way, int size>
__device__ void mergeWords(std::uint32_t (&words)[size]) {
  if constexpr (2 * way < count) {
    mergeWords<first, count, 2 * way>(words);
    mergeWords<first + way, count, 2 * way>(words);
#pragma unroll
    for (int i = first + way; i + way < first + count; i += 2 * way)
      putInOrder(words[i], words[i + way]);
  } else {
    putInOrder(words[first], words[first + way]);
  }
}
template <int first, int count, int size>
__device__ void sortWords(std::uint32_t (&words)[size]) {
  if constexpr (count > 1) {
    sortWords<first, count / 2>(words);
    sortWords<first + count / 2, count / 2>(words);
    mergeWords<first, count, 1>(words);
  }
}

// Copies a list from the rows of several parts, in no order. Four words are read at once, as below.
__device__ void gatherList(const Lists& of, std::size_t slot, unsigned long long begin,
                           std::uint32_t length, std::uint32_t* to) {
  std::uint32_t filled = 0;
  for (std::uint32_t part = 0; part < of.rows.parts; ++part) {
    const std::uint32_t count = rowCount(of.rows, part, slot);
    const uint4* const row = reinterpret_cast<const uint4*>(rowOf(of.rows, part, slot));
    for (std::uint32_t k = 0; k < count; k += 4) {
      const uint4 four = row[k / 4];
      to[filled++] = four.x;
      if (k + 1 < count) to[filled++] = four.y;
      if (k + 2 < count) to[filled++] = four.z;
      if (k + 3 < count) to[filled++] = four.w;
    }
  }
  for (; filled < length; ++filled) to[filled] = of.words[begin + filled];
}

// The words of a list of one part, into registers. Four words are
// read from a row at once, some behind the list's end perhaps, but never behind the row's, which is
// a multiple of 16 bytes.
template <int size>
__device__ void loadList(const Lists& of, std::size_t slot, unsigned long long begin,
                         std::uint32_t length, std::uint32_t (&words)[size]) {
  const uint4* const row = reinterpret_cast<const uint4*>(rowOf(of.rows, 0, slot));
#pragma unroll
  for (int k = 0; k < size; k += 4) {
    uint4 four = {};
    if (k < length && k < of.rows.length) {
      four = row[k / 4];
    } else if (k < length) {
      four.x = of.words[begin + k];
      if (k + 1 < length) four.y = of.words[begin + k + 1];
      if (k + 2 < length) four.z = of.words[begin + k + 2];
      if (k + 3 < length) four.w = of.words[begin + k + 3];
    }
    words[k] = four.x;
    words[k + 1] = four.y;
    words[k + 2] = four.z;
    words[k + 3] = four.w;
  }
}

// Copies a list of at most `size` words, sorted. Where rows are of several parts it has been
// gathered at `to`.
template <bool of_parts, int size>
__device__ void sortList(const Lists& of, std::size_t slot, unsigned long long begin,
                         std::uint32_t length, std::uint32_t* to) {
  std::uint32_t words[size];
  if constexpr (of_parts) {
#pragma unroll
    for (int k = 0; k < size; ++k)
      if (k < length) words[k] = to[k];
  } else {
    loadList(of, slot, begin, length, words);
  }
#pragma unroll
  for (int k = 0; k < size; ++k)
    if (k >= length) words[k] = no_word;
  sortWords<0, size>(words);
#pragma unroll
  for (int k = 0; k < size; ++k)
    if (k < length) to[k] = words[k];
}

constexpr int line_pairs = 16;  // fixed: 128 bytes

static_assert(list_block <= 256, "a byte tells a list of a block");
static_assert(long_list == 32, "registers hold the words of a list");

// The short lists of one block of slots, one after the other.
struct ShortLists {
  std::uint32_t words[list_block * long_list];
  std::uint8_t list_at[list_block * long_list];  // of each word
  unsigned long long shift[list_block];          // what a list's words are ahead of their places
  std::uint32_t warp_sums[list_block / 32];
};

// One block list_block slots, one thread a short list: sorted into shared memory, from which all
// write word after word. These are list_block * long_list words at most, and go to where `begins`
// says. If found pairs did not fit, scatter left places unfilled: words are anything then, and the
// search is made again.
template <bool of_parts>
__global__ void __launch_bounds__(list_block) sortKernel(Lists of) {
  __shared__ ShortLists block;
  const std::size_t slots = of.slots;
  if (of.begins[slots] > of.capacity) return;
  const int t = threadIdx.x, lane = t % 32, warp = t / 32;
  const std::size_t first = std::size_t{blockIdx.x} * list_block, slot = first + t;
  const unsigned long long begin = of.begins[min(slot, slots)];
  const unsigned long long end = of.begins[min(slot + 1, slots)];
  const std::uint32_t length =
      end - begin > long_list ? 0 : static_cast<std::uint32_t>(end - begin);
  std::uint32_t place = length;
  for (int step = 1; step < 32; step *= 2) {
    const std::uint32_t below = __shfl_up_sync(all_lanes, place, step);
    if (lane >= step) place += below;
  }
  if (lane == 31) block.warp_sums[warp] = place;
  place -= length;
  __syncthreads();
  std::uint32_t count = 0;
  for (int i = 0; i < list_block / 32; ++i) {
    if (i == warp) place += count;
    count += block.warp_sums[i];
  }

  std::uint32_t* const to = block.words + place;
  const int longest = warpMax(static_cast<int>(length));
  if (of_parts && length) gatherList(of, slot, begin, length, to);
  if (longest <= 8)
    sortList<of_parts, 8>(of, slot, begin, length, to);
  else if (longest <= 16)
    sortList<of_parts, 16>(of, slot, begin, length, to);
  else
    sortList<of_parts, long_list>(of, slot, begin, length, to);
  for (std::uint32_t k = 0; k < length; ++k)
    block.list_at[place + k] = static_cast<std::uint8_t>(t);
  block.shift[t] = begin - place;
  __syncthreads();
  // Warps write whole lines: the host's memory may be where they go.
  const int ahead = static_cast<int>(of.begins[first] % line_pairs);
  for (int i = t - ahead; i < static_cast<int>(count); i += list_block) {
    if (i < 0) continue;
    const int list = block.list_at[i];
    writePair(of.to, block.shift[list] + i, block.words[i],
              static_cast<std::uint32_t>(first + list));
  }
}

// The long lists, in no order, and their words, list after list. Their keys: the list's number
// above the word.
struct LongWords {
  LongSlots lists;
  std::uint32_t count;
  unsigned long long words;
  int word_bits;
};

// One thread a word of the long lists, in strides.
__global__ void __launch_bounds__(block_threads)
    gatherKernel(Lists lists, LongWords from, std::uint64_t* keys) {
  const unsigned long long stride = std::size_t{gridDim.x} * block_threads;
  for (unsigned long long i = blockIdx.x * std::size_t{block_threads} + threadIdx.x; i < from.words;
       i += stride) {
    std::uint32_t low = 0, high = from.count - 1;  // the last list whose offset is at or before i
    while (low < high) {
      const std::uint32_t middle = low + (high - low + 1) / 2;
      if (from.lists.offsets[middle] <= i)
        low = middle;
      else
        high = middle - 1;
    }
    const std::uint32_t slot = from.lists.slots[low];
    keys[i] = std::uint64_t{low} << from.word_bits |
              wordAt(lists, slot, lists.begins[slot], i - from.lists.offsets[low]);
  }
}

// The way back, once the keys are sorted: list follows list as before.
__global__ void __launch_bounds__(block_threads)
    spreadKernel(const std::uint64_t* keys, LongWords from, Lists lists) {
  const unsigned long long stride = std::size_t{gridDim.x} * block_threads;
  for (unsigned long long i = blockIdx.x * std::size_t{block_threads} + threadIdx.x; i < from.words;
       i += stride) {
    const std::uint32_t list = static_cast<std::uint32_t>(keys[i] >> from.word_bits);
    const std::uint32_t word = static_cast<std::uint32_t>(keys[i]) & ((1u << from.word_bits) - 1);
    const std::uint32_t slot = from.lists.slots[list];
    writePair(lists.to, lists.begins[slot] + (i - from.lists.offsets[list]), word, slot);
  }
}

template <class In>
void scan(const In* values, unsigned long long* sums, std::size_t count,
          const ScratchQueue& queue) {
  withScratch(queue, [&](void* scratch, std::size_t& bytes) {
    CHECK_CUDA(cub::DeviceScan::ExclusiveScan(scratch, bytes, values, sums, Add(), 0ull,
                                              static_cast<std::int64_t>(count), queue.stream));
  });
}

int bitsFor(std::uint64_t values) {
  int bits = 0;
  while (bits < 64 && values >> bits) ++bits;
  return bits;
}

// Which lists are a device's own, where several share a scene.

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

void scanCounts(const std::uint32_t* counts, unsigned long long* begins, std::size_t slots,
                const ScratchQueue& queue) {
  scan(counts, begins, slots + 1, queue);
}

void summariseLists(const std::uint32_t* counts, const unsigned long long* begins,
                    std::size_t slots, ScenePlan* plan, const LongSlots& long_slots,
                    const KernelQueue& queue) {
  launch("summarise lists", summariseKernel, (slots + list_block - 1) / list_block, list_block,
         queue.stream, counts, begins, slots, plan, long_slots);
}

void scatterPairs(const FoundPairs& found, const ScenePlan* plan, const OpenLists& to,
                  const KernelQueue& queue) {
  launch("scatter pairs", scatterKernel<false>, std::size_t(queue.processors) * blocks_a_processor,
         block_threads, queue.stream, found.pairs, found.capacity, plan, to);
}

void scatterOwnPairs(const Found* found, std::size_t count, const ScenePlan* plan,
                     const OpenLists& to, const KernelQueue& queue) {
  launch("scatter own pairs", scatterKernel<true>, blocksFor(count, queue), block_threads,
         queue.stream, found, count, plan, to);
}

void sortLists(const Lists& lists, const KernelQueue& queue) {
  launch("sort lists", lists.rows.parts > 1 ? sortKernel<true> : sortKernel<false>,
         (lists.slots + list_block - 1) / list_block, list_block, queue.stream, lists);
}

void sortLongLists(const Lists& lists, const LongSlots& long_slots, unsigned long long long_lists,
                   DeviceBuffer<std::uint64_t> (&keys)[2], const ScratchQueue& queue) {
  const LongWords from = {long_slots, static_cast<std::uint32_t>(long_lists / one_long_list),
                          long_lists & most_long_words, bitsFor(2 * lists.slots - 1)};
  for (DeviceBuffer<std::uint64_t>& each : keys) each.reserve(from.words);
  const std::size_t blocks = blocksFor(from.words, queue);
  launch("gather long lists", gatherKernel, blocks, block_threads, queue.stream, lists, from,
         keys[0].data());
  std::uint64_t* const sorted = keys[1].data();
  withScratch(queue, [&](void* scratch, std::size_t& bytes) {
    CHECK_CUDA(cub::DeviceRadixSort::SortKeys(
        scratch, bytes, keys[0].data(), sorted, static_cast<std::int64_t>(from.words), 0,
        from.word_bits + bitsFor(from.count - 1), queue.stream));
  });
  launch("spread long lists", spreadKernel, blocks, block_threads, queue.stream, sorted, from,
         lists);
}

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
