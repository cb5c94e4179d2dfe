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

// The paper's two kernels in one: a thread looks for its pairs of the fullest axis in the second
// and, if they are there, in the third. A block collects those that it finds in shared memory and
// asks for their places at once. They are at most its tile's, so `found` has room for all.
__global__ void meetKernel(AxisViews axes, Places places, Pair* found, unsigned long long* count) {
  __shared__ Pair own[tile_pairs];
  __shared__ std::uint32_t own_count;
  __shared__ unsigned long long place_of_own;
  const AxisView& first = axes.first;
  const unsigned long long begin =
      places.begin + static_cast<unsigned long long>(blockIdx.x) * tile_pairs;
  const unsigned long long end = min(begin + tile_pairs, places.end);
  if (threadIdx.x == 0) own_count = 0;
  const TileRows rows(first, begin, end);  // waits for all threads
  for (unsigned long long place = begin + threadIdx.x; place < end; place += block_threads) {
    const std::uint32_t a = first.order[rowOf(first.begins, rows.low, rows.high, place)];
    const std::uint32_t b = first.list[place - first.first];
    if (b != no_box && holds(axes.second, a, b) && holds(axes.third, a, b))
      own[atomicAdd(&own_count, 1u)] = Pair{a} << 32 | b;
  }
  __syncthreads();
  if (threadIdx.x == 0) place_of_own = atomicAdd(count, static_cast<unsigned long long>(own_count));
  __syncthreads();
  for (std::uint32_t i = threadIdx.x; i < own_count; i += block_threads)
    found[place_of_own + i] = own[i];
}

std::size_t tilesFor(unsigned long long pairs) {
  return static_cast<std::size_t>((pairs + tile_pairs - 1) / tile_pairs);
}

}  // namespace

void fillList(const AxisView& axis, cudaStream_t stream) {
  if (axis.first < axis.last)
    launch("fill list", fillKernel, tilesFor(axis.last - axis.first), block_threads, stream, axis);
}

void findCommon(const AxisViews& axes, const Places& places, Pair* found, unsigned long long* count,
                cudaStream_t stream) {
  CHECK_CUDA(cudaMemsetAsync(count, 0, sizeof *count, stream));
  if (places.begin < places.end)
    launch("meet axes", meetKernel, tilesFor(places.end - places.begin), block_threads, stream,
           axes, places, found, count);
}

}  // namespace device
}  // namespace ode_parallel_sap
