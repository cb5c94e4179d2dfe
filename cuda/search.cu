#include "search.h"
//
#include "primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

constexpr int search_warps = 8;  // a block
constexpr int search_threads = search_warps * 32;
constexpr int blocks_a_processor = 4;

// Places of `found` that a warp takes at a time: few takers meet at the counter, and what the last
// ones leave empty stays small.
constexpr std::uint32_t chunk_places = 256;

struct Tree {
  const Record* level[most_levels];
};

// The same with the number of records, in shared memory: indexed at run time.
struct LevelTable {
  const Record* at[most_levels];
  std::uint32_t count[most_levels];
};

// Cells whose boxes are loaded together, to wait for memory once.
constexpr int cells_at_once = 2;

// What one warp keeps in shared memory. A node leaves at most fan_out children a level on the stack;
// the queues take what one node or one cell has on top of less than a warp's.
struct WarpSpace {
  float4 query_low[cell_size], query_high[cell_size];
  float4 low[2 * cell_size], high[2 * cell_size];
  uint2 cells[2 * fan_out];  // first place, number of boxes
  std::uint32_t stack[fan_out * (most_levels - 1)];
};

constexpr int level_shift = 28;  // nodes above the cells are fewer than 2^28

// Hands out places of `found` to a warp. All members are the same in all lanes.
struct Places {
  ScenePlan* plan;
  unsigned long long at = 0;
  std::uint32_t left = 0;

  __device__ unsigned long long take(std::uint32_t count, int lane) {
    unsigned long long first = 0;
    if (lane == 0) first = atomicAdd(&plan->counters.found, static_cast<unsigned long long>(count));
    return __shfl_sync(all_lanes, first, 0);
  }
};

template <bool exact, bool filtered>
struct Search {
  WarpSpace& space;
  const SearchFilter filter;
  Places places;
  Found* const found;
  const unsigned long long capacity;
  std::uint32_t* const counts;
  const int lane;
  std::uint32_t query_count = 0;
  int queued = 0, celled = 0;

  // Which of the query's boxes may meet box `slot` by their bits and bodies.
  __device__ std::uint32_t passing(std::uint32_t hits, std::uint32_t slot) const {
    std::uint32_t passed = 0;
    const uint2 bits = filter.bits && hits ? filter.bits[slot] : make_uint2(~0u, ~0u);
    const std::uint32_t body = filter.bodies && hits ? filter.bodies[slot] : 0;
    for (std::uint32_t left = hits; left; left &= left - 1) {
      const int q = __ffs(left) - 1;
      const std::uint32_t other = __float_as_uint(space.query_low[q].w);
      bool pass = true;
      if (filter.bits) {
        const uint2 others = filter.bits[other];
        pass = ((bits.x & others.y) | (bits.y & others.x)) != 0;
      }
      if (body) pass = pass && filter.bodies[other] != body;
      if (pass) passed |= 1u << q;
    }
    return passed;
  }

  // Writes the pairs of each lane's box with the query's boxes in `hits`.
  __device__ void write(std::uint32_t hits, const float4& low, const float4& high) {
    const std::uint32_t own = __popc(hits);
    std::uint32_t sum = own;
    for (int step = 1; step < 32; step *= 2) {
      const std::uint32_t below = __shfl_up_sync(all_lanes, sum, step);
      if (lane >= step) sum += below;
    }
    const std::uint32_t all = __shfl_sync(all_lanes, sum, 31);
    unsigned long long fresh = 0;
    std::uint32_t taken = 0;
    if (all > places.left) {
      taken = max(chunk_places, all - places.left);
      fresh = places.take(taken, lane);
    }
    // A lane's pairs of which its own box is the earlier one come first, in a row: they are counted
    // and later put into their list together.
    const std::uint32_t slot = __float_as_uint(low.w);
    std::uint32_t front = sum - own, back = sum;
    for (; hits; hits &= hits - 1) {
      const int q = __ffs(hits) - 1;
      const float4 query_low = space.query_low[q];
      const std::uint32_t other = __float_as_uint(query_low.w);
      const bool unsure = !exact && isUnsure(query_low, space.query_high[q], low, high);
      const bool first = slot < other;
      const std::uint32_t earlier = first ? slot : other, later = first ? other : slot;
      const std::uint32_t k = first ? front++ : --back;
      const unsigned long long place = k < places.left ? places.at + k : fresh + (k - places.left);
      if (place < capacity) found[place] = Found{earlier} << 32 | later << 1 | unsure;
      if (!first) atomicAdd(&counts[other], 1u);
    }
    if (front > sum - own) atomicAdd(&counts[slot], front - (sum - own));
    if (taken) {
      places.at = fresh + (all - places.left);
      places.left = taken - (all - places.left);
    } else {
      places.at += all;
      places.left -= all;
    }
  }

  // One lane a box: meets all of the query's boxes, or those of them that come before `lane` in the
  // same cell.
  __device__ void meet(const float4& low, const float4& high, bool used, bool same_cell) {
    std::uint32_t hits = 0;
#pragma unroll 4
    for (std::uint32_t q = 0; q < query_count; ++q)
      hits |=
          static_cast<std::uint32_t>(overlap(space.query_low[q], space.query_high[q], low, high))
          << q;
    if (same_cell) hits &= (1u << lane) - 1;
    if (!used) hits = 0;
    if (filtered) hits = passing(hits, __float_as_uint(low.w));
    if (__any_sync(all_lanes, hits)) write(hits, low, high);
  }

  __device__ void meetQueued(int count) {
    __syncwarp();
    const bool used = lane < count;
    const float4 low = space.low[lane], high = space.high[lane];
    meet(low, high, used, false);
    // What lies above the first warp's width moves down.
    const int left = queued - count;
    float4 moved_low, moved_high;
    if (lane < left) {
      moved_low = space.low[count + lane];
      moved_high = space.high[count + lane];
    }
    __syncwarp();
    if (lane < left) {
      space.low[lane] = moved_low;
      space.high[lane] = moved_high;
    }
    queued = left;
  }

  // Queues the boxes of the cells that the query's bounds reach.
  __device__ void visitCells(const Record* sorted, const Record& query) {
    __syncwarp();
    for (int first = 0; first < celled; first += cells_at_once) {
      Record box[cells_at_once];
      bool used[cells_at_once];
#pragma unroll
      for (int i = 0; i < cells_at_once; ++i) {
        used[i] = false;
        if (first + i >= celled) continue;
        const uint2 cell = space.cells[first + i];
        used[i] = lane < cell.y;
        if (used[i]) box[i] = sorted[cell.x + lane];
      }
#pragma unroll
      for (int i = 0; i < cells_at_once; ++i) {
        const bool hit = used[i] && overlap(query.low, query.high, box[i].low, box[i].high);
        const unsigned mask = __ballot_sync(all_lanes, hit);
        if (hit) {
          const int place = queued + __popc(mask & ((1u << lane) - 1));
          space.low[place] = box[i].low;
          space.high[place] = box[i].high;
        }
        queued += __popc(mask);
        if (queued >= 32) meetQueued(32);
      }
    }
    celled = 0;
    __syncwarp();
  }
};

// One warp a cell, cells in strides of the grid. Levels, counts and nodes are those of the tree
// that plan->counters.cells gives; a child is read only below its level's count, a box only below
// its cell's.
template <bool exact, bool filtered>
__global__ void __launch_bounds__(search_threads, blocks_a_processor)
    searchKernel(const Record* __restrict__ sorted, Tree tree, SearchFilter filter, ScenePlan* plan,
                 Found* found, unsigned long long capacity, std::uint32_t* counts,
                 bool ignore_crowds) {
  __shared__ WarpSpace spaces[search_warps];
  __shared__ LevelTable levels;
  __shared__ int top_level;  // the lowest one of at most fan_out records
  if (plan->counters.crowded && !ignore_crowds) return;
  const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const std::uint32_t cell_count = plan->counters.cells;
  if (threadIdx.x == 0) {
    top_level = -1;
    std::uint32_t count = cell_count;
    for (int level = 0; level < most_levels; ++level) {
      levels.at[level] = tree.level[level];
      levels.count[level] = count;
      if (count <= fan_out && top_level < 0) top_level = level;
      count = (count + fan_out - 1) / fan_out;
    }
  }
  __syncthreads();
  Search<exact, filtered> search = {spaces[warp], filter, {plan}, found, capacity, counts, lane};
  WarpSpace& space = spaces[warp];

  const std::uint32_t stride = gridDim.x * search_warps;
  for (std::uint32_t cell = blockIdx.x * search_warps + warp; cell < cell_count; cell += stride) {
    const Record query = tree.level[0][cell];
    const std::uint32_t start = __float_as_uint(query.low.w);
    search.query_count = __float_as_uint(query.high.w);
    search.queued = 0;
    Record own = {};
    const bool used = lane < search.query_count;
    if (used) own = sorted[start + lane];
    __syncwarp();
    space.query_low[lane] = own.low;
    space.query_high[lane] = own.high;
    __syncwarp();
    search.meet(own.low, own.high, used, true);

    // A node on the stack stands for its children, one level below.
    int stacked = 1;
    if (lane == 0) space.stack[0] = static_cast<std::uint32_t>(top_level) << level_shift;
    __syncwarp();
    while (stacked) {
      const std::uint32_t node = space.stack[--stacked];
      const int level = node >> level_shift;
      __syncwarp();
      const std::uint32_t child = (node & ((1u << level_shift) - 1)) * fan_out + lane;
      Record bounds = {};
      bool hit = child < levels.count[level] && child >= (cell + 1) >> 5 * level;
      if (hit) {
        bounds = levels.at[level][child];
        hit = overlap(query.low, query.high, bounds.low, bounds.high);
      }
      const unsigned mask = __ballot_sync(all_lanes, hit);
      if (level) {
        if (hit)
          space.stack[stacked + __popc(mask & ((1u << lane) - 1))] =
              static_cast<std::uint32_t>(level - 1) << level_shift | child;
        stacked += __popc(mask);
        __syncwarp();
      } else {
        if (hit)
          space.cells[search.celled + __popc(mask & ((1u << lane) - 1))] =
              make_uint2(__float_as_uint(bounds.low.w), __float_as_uint(bounds.high.w));
        search.celled += __popc(mask);
        if (search.celled >= fan_out) search.visitCells(sorted, query);
      }
    }
    search.visitCells(sorted, query);
    if (search.queued) search.meetQueued(search.queued);
  }
  for (std::uint32_t i = lane; i < search.places.left; i += 32)
    if (search.places.at + i < capacity) found[search.places.at + i] = nothing_found;
}

template <bool exact, bool filtered>
void launchSearch(const Record* sorted, const Tree& tree, const SearchFilter& filter,
                  ScenePlan* plan, Found* found, unsigned long long capacity, std::uint32_t* counts,
                  bool ignore_crowds, int processors, cudaStream_t stream) {
  launch("find pairs", searchKernel<exact, filtered>, std::size_t(processors) * blocks_a_processor,
         search_threads, stream, sorted, tree, filter, plan, found, capacity, counts,
         ignore_crowds);
}

}  // namespace

void findPairs(const Record* sorted, const Record* records, const TreeLayout& layout,
               const SearchFilter& filter, bool exact, ScenePlan* plan, Found* found,
               unsigned long long capacity, std::uint32_t* counts, bool ignore_crowds,
               int processors, cudaStream_t stream) {
  Tree tree;
  for (int level = 0; level < most_levels; ++level)
    tree.level[level] = records + layout.begin[level];
  const bool filtered = filter.bits || filter.bodies;
  const auto chosen = exact      ? filtered ? launchSearch<true, true> : launchSearch<true, false>
                           : filtered ? launchSearch<false, true>
                                 : launchSearch<false, false>;
  chosen(sorted, tree, filter, plan, found, capacity, counts, ignore_crowds, processors, stream);
}

}  // namespace device
}  // namespace ode_parallel_sap
