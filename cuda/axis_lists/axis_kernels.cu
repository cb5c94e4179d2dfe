#include "cuda/axis_lists/axis_kernels.h"
//
#include "cuda/device/launch.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

// Pairs that a block deals with at a time.
constexpr int tile_pairs = block_threads * pairs_a_thread;

// In place of the later box of an entry that does not overlap after all.
constexpr std::uint32_t no_box = 0xffffffff;

// The last row of [low, high) that begins at or before `place`; begins[low] <= place, and place <
// begins[high].
__device__ std::uint32_t rowOf(const std::uint64_t* begins, std::uint32_t low, std::uint32_t high,
                               unsigned long long place) {
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (begins[middle] <= place)
      low = middle;
    else
      high = middle;
  }
  return low;
}

// Tells all threads of a block between which rows the places [begin, end) lie; end > begin. Two
// threads search the whole axis, the others only between their results.
struct TileRows {
  std::uint32_t low, high;

  __device__ TileRows(const AxisView& axis, unsigned long long begin, unsigned long long end) {
    __shared__ std::uint32_t found[2];
    if (threadIdx.x < 2)
      found[threadIdx.x] = rowOf(axis.begins, 0, axis.count, threadIdx.x ? end - 1 : begin);
    __syncthreads();
    low = found[0];
    high = found[1] + 1;
  }
};

// Whether the list of an axis holds the pair of boxes a and b. The list is whole, so that every
// place of a row is in it.
__device__ bool holds(const AxisView& axis, std::uint32_t a, std::uint32_t b) {
  const std::uint32_t rank_a = axis.ranks[a], rank_b = axis.ranks[b];
  const std::uint32_t row = min(rank_a, rank_b), other = max(rank_a, rank_b);
  return other < axis.reach[row] &&
         axis.list[axis.begins[row] + (other - row - 1)] == (rank_a < rank_b ? b : a);
}

// Collects pairs in shared memory and writes them behind each other: one place is asked for a tile.
// At most tile_pairs can be added between start() and write(), both of which all threads call.
class TileOutput {
 public:
  __device__ void start() {
    if (threadIdx.x == 0) *count() = 0;
    __syncthreads();
  }
  __device__ void add(Pair pair) { pairs()[atomicAdd(count(), 1u)] = pair; }
  __device__ void write(Pair* to, unsigned long long* written) {
    __shared__ unsigned long long first;
    __syncthreads();
    if (threadIdx.x == 0) first = atomicAdd(written, static_cast<unsigned long long>(*count()));
    __syncthreads();
    for (std::uint32_t i = threadIdx.x; i < *count(); i += block_threads)
      to[first + i] = pairs()[i];
    __syncthreads();
  }

 private:
  static __device__ Pair* pairs() {
    __shared__ Pair storage[tile_pairs];
    return storage;
  }
  static __device__ std::uint32_t* count() {
    __shared__ std::uint32_t number;
    return &number;
  }
};

// One thread a pair, eight after each other, neighbours in memory side by side. Writes
// list[place - first] for each place of the block's tile below `last`.
__global__ void fillKernel(AxisView axis) {
  const unsigned long long begin =
      axis.first + static_cast<unsigned long long>(blockIdx.x) * tile_pairs;
  const unsigned long long end = min(begin + tile_pairs, axis.last);
  const TileRows rows(axis, begin, end);
  for (unsigned long long place = begin + threadIdx.x; place < end; place += block_threads) {
    const std::uint32_t row = rowOf(axis.begins, rows.low, rows.high, place);
    const std::uint32_t other = static_cast<std::uint32_t>(row + 1 + (place - axis.begins[row]));
    const bool overlap = !axis.inverted || axis.reach[other] > row;
    axis.list[place - axis.first] = overlap ? axis.order[other] : no_box;
  }
}

// The paper's first kernel: one thread a pair of the fullest axis looks for it in the second. The
// tile's hits are at most its pairs, so `both` has room for those of all tiles.
__global__ void meetKernel(AxisView first, AxisView second, Places places, Pair* both,
                           unsigned long long* written) {
  const unsigned long long begin =
      places.begin + static_cast<unsigned long long>(blockIdx.x) * tile_pairs;
  const unsigned long long end = min(begin + tile_pairs, places.end);
  const TileRows rows(first, begin, end);
  TileOutput output;
  output.start();
  for (unsigned long long place = begin + threadIdx.x; place < end; place += block_threads) {
    const std::uint32_t a = first.order[rowOf(first.begins, rows.low, rows.high, place)];
    const std::uint32_t b = first.list[place - first.first];
    if (b != no_box && holds(second, a, b)) output.add(Pair{a} << 32 | b);
  }
  output.write(both, written);
}

// The paper's second kernel: one thread a pair that is left looks for it in the third axis. The
// number of pairs is known on the device only; blocks take tiles in strides of the grid.
__global__ void keepKernel(AxisView third, const Pair* both, const unsigned long long* count,
                           Pair* all, unsigned long long* written) {
  const unsigned long long pairs = *count, stride = std::size_t{gridDim.x} * tile_pairs;
  TileOutput output;
  for (unsigned long long begin = std::size_t{blockIdx.x} * tile_pairs; begin < pairs;
       begin += stride) {
    const unsigned long long end = min(begin + tile_pairs, pairs);
    output.start();
    for (unsigned long long i = begin + threadIdx.x; i < end; i += block_threads) {
      const Pair pair = both[i];
      if (holds(third, static_cast<std::uint32_t>(pair >> 32), static_cast<std::uint32_t>(pair)))
        output.add(pair);
    }
    output.write(all, written);
  }
}

std::size_t tilesFor(unsigned long long pairs) {
  return static_cast<std::size_t>((pairs + tile_pairs - 1) / tile_pairs);
}

}  // namespace

void fillList(const AxisView& axis, cudaStream_t stream) {
  if (axis.first < axis.last)
    launch("fill list", fillKernel, tilesFor(axis.last - axis.first), block_threads, stream, axis);
}

void findCommon(const AxisViews& axes, const Places& places, const CommonPairs& found,
                const KernelQueue& queue) {
  CHECK_CUDA(cudaMemsetAsync(found.counts, 0, sizeof *found.counts, queue.stream));
  if (places.begin >= places.end) return;
  const std::size_t tiles = tilesFor(places.end - places.begin);
  launch("meet second axis", meetKernel, tiles, block_threads, queue.stream, axes.first,
         axes.second, places, found.both, &found.counts->both);
  launch("meet third axis", keepKernel, blocksFor(tiles, 1, queue), block_threads, queue.stream,
         axes.third, found.both, &found.counts->both, found.all, &found.counts->all);
}

}  // namespace device
}  // namespace ode_parallel_sap
