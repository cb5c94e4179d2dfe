#include "cuda/one/search.h"
//
#include "cuda/one/primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

// fixed: the spaces of a block's warps fill the 48 kB of shared memory that every device has.
constexpr int search_warps = 8;
constexpr int search_threads = search_warps * 32;

struct Tree {
  Records level[most_levels];
};

// The same with the number of records, in shared memory: indexed at run time.
struct LevelTable {
  Records at[most_levels];
  std::uint32_t count[most_levels];
};

constexpr int queue_size = cell_size + cells_at_once * cell_size;

// What one warp keeps in shared memory. A node leaves at most fan_out children a level on the
// stack; the queue takes what cells_at_once cells have on top of less than a warp's boxes, `cells`
// what one node has.
struct WarpSpace {
  float4 query_low[cell_size], query_high[cell_size];
  float4 low[queue_size], high[queue_size];
  uint2 cells[fan_out];  // first place, number of boxes
  std::uint32_t stack[fan_out * (most_levels - 1)];
};

constexpr int level_shift = 28;  // fixed: nodes above the cells are fewer than 2^28

// Hands out places of `found` to a warp. All members are the same in all lanes.
struct Places {
  ScenePlan* plan;
  Found* found;
  unsigned long long capacity;
  Found* at = nullptr;
  std::uint32_t left = 0;

  // `count` places, at most overflow_places: those behind the capacity if it does not suffice.
  __device__ Found* take(std::uint32_t count, int lane) {
    unsigned long long first = 0;
    if (lane == 0) first = atomicAdd(&plan->counters.found, static_cast<unsigned long long>(count));
    first = __shfl_sync(all_lanes, first, 0);
    return found + (first + count <= capacity ? first : capacity);
  }
};
static_assert(overflow_places >= cell_size * cell_size && overflow_places >= chunk_places,
              "a warp's hits fit behind the capacity");

template <bool exact, bool filtered>
struct Search {
  WarpSpace& space;
  const SearchFilter filter;
  Places places;
  std::uint32_t* const counts;
  const int lane;
  std::uint32_t query_count = 0;
  int queued = 0, own_left = 0, celled = 0, stacked = 0;

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

  // Writes the pairs of each lane's box with the query's boxes in `hits`: in each round one of
  // every lane that has one left, side by side.
  __device__ void write(std::uint32_t hits, const float4& low, const float4& high) {
    const std::uint32_t all = warpSum(__popc(hits));
    Found* fresh = nullptr;  // so that fresh[k] is the place of pair k
    std::uint32_t taken = 0;
    if (all > places.left) {
      taken = max(chunk_places, all - places.left);
      fresh = places.take(taken, lane) - places.left;
    }
    const std::uint32_t slot = __float_as_uint(low.w), lanes_below = (1u << lane) - 1;
    std::uint32_t earlier_here = 0;  // pairs of which the lane's own box is the earlier one
    std::uint32_t written = 0;
    for (unsigned active; (active = __ballot_sync(all_lanes, hits != 0)) != 0;) {
      const std::uint32_t k = written + __popc(active & lanes_below);
      written += __popc(active);
      if (!hits) continue;
      const int q = __ffs(hits) - 1;
      hits &= hits - 1;
      const float4 query_low = space.query_low[q], query_high = space.query_high[q];
      const std::uint32_t other = __float_as_uint(query_low.w);
      const bool borderline = !exact && !isClear(query_low, query_high, low, high) &&
                              overlapIsBorderline(query_low, query_high, low, high);
      const std::uint32_t earlier = min(slot, other), later = max(slot, other);
      (k < places.left ? places.at : fresh)[k] = Found{earlier} << 32 | later << 1 | borderline;
      if (earlier == slot)
        ++earlier_here;
      else
        atomicAdd(&counts[other], 1u);
    }
    if (earlier_here) atomicAdd(&counts[slot], earlier_here);
    if (taken) {
      places.at = fresh + all;
      places.left = taken - (all - places.left);
    } else {
      places.at += all;
      places.left -= all;
    }
  }

  // One lane a box, the last ones of the queue: each meets all of the query's boxes. The first
  // `own_left` places of the queue are the query's own boxes: these meet those before them.
  __device__ void meetQueued() {
    __syncwarp();
    const int first = max(queued - 32, 0), place = first + lane;
    const bool used = place < queued;
    const float4 low = space.low[place], high = space.high[place];
    std::uint32_t hits = 0;
#pragma unroll 2
    for (std::uint32_t q = 0; q < query_count; ++q)
      hits |=
          static_cast<std::uint32_t>(overlap(space.query_low[q], space.query_high[q], low, high))
          << q;
    if (place < own_left) hits &= (1u << place) - 1;
    if (!used) hits = 0;
    if (filtered) hits = passing(hits, __float_as_uint(low.w));
    if (__any_sync(all_lanes, hits)) write(hits, low, high);
    queued = first;
    own_left = min(own_left, first);
    __syncwarp();
  }

  // Queues the boxes of the last queued cells that the query's bounds reach.
  __device__ void visitCells(const Records& sorted, const Record& query) {
    const int first = max(celled - cells_at_once, 0);
    Record box[cells_at_once];
    bool hit[cells_at_once];
#pragma unroll
    for (int i = 0; i < cells_at_once; ++i) {
      hit[i] = false;
      if (first + i >= celled) continue;
      const uint2 cell = space.cells[first + i];
      hit[i] = lane < cell.y;
      if (hit[i]) box[i] = sorted[cell.x + lane];
    }
#pragma unroll
    for (int i = 0; i < cells_at_once; ++i) {
      hit[i] = hit[i] && overlap(query.low, query.high, box[i].low, box[i].high);
      const unsigned mask = __ballot_sync(all_lanes, hit[i]);
      if (hit[i]) {
        const int place = queued + __popc(mask & ((1u << lane) - 1));
        space.low[place] = box[i].low;
        space.high[place] = box[i].high;
      }
      queued += __popc(mask);
    }
    celled = first;
    __syncwarp();
  }

  // Takes the last node from the stack; its children that the query's bounds reach, beyond cell
  // `cell`, go onto the stack or, if they are cells, to those to be visited.
  __device__ void expandNode(const LevelTable& levels, const Record& query, std::uint32_t cell) {
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
    const int before = __popc(mask & ((1u << lane) - 1));
    if (level) {
      if (hit)
        space.stack[stacked + before] =
            static_cast<std::uint32_t>(level - 1) << level_shift | child;
      stacked += __popc(mask);
    } else {
      if (hit)
        space.cells[celled + before] =
            make_uint2(__float_as_uint(bounds.low.w), __float_as_uint(bounds.high.w));
      celled += __popc(mask);
    }
    __syncwarp();
  }
};

// One warp a cell, cells in strides of the grids of all parts. Levels, counts and nodes are those
// of the tree that plan->counters.cells gives; a child is read only below its level's count, a box
// only below its cell's.
template <bool exact, bool filtered>
__global__ void __launch_bounds__(search_threads, search_blocks_a_processor)
    searchKernel(const Records sorted, const Tree tree, SearchRules rules, ScenePlan* plan,
                 FoundPairs found, std::uint32_t* counts) {
  __shared__ WarpSpace spaces[search_warps];
  __shared__ LevelTable levels;
  __shared__ int top_level;  // the lowest one of at most fan_out records
  if (plan->counters.clustered && !rules.ignore_clusters) return;
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
  Search<exact, filtered> search = {
      spaces[warp], rules.filter, {plan, found.pairs, found.capacity}, counts, lane};
  WarpSpace& space = spaces[warp];

  const Part part = rules.part;
  const std::uint32_t stride = gridDim.x * part.count * search_warps;
  for (std::uint32_t cell = (blockIdx.x * part.count + part.index) * search_warps + warp;
       cell < cell_count; cell += stride) {
    const Record query = tree.level[0][cell];
    const std::uint32_t start = __float_as_uint(query.low.w);
    search.query_count = __float_as_uint(query.high.w);
    Record own = {};
    if (lane < search.query_count) own = sorted[start + lane];
    space.query_low[lane] = space.low[lane] = own.low;
    space.query_high[lane] = space.high[lane] = own.high;
    if (lane == 0) space.stack[0] = static_cast<std::uint32_t>(top_level) << level_shift;
    __syncwarp();
    search.queued = search.own_left = search.query_count;
    search.stacked = 1;
    do {
      while (search.queued < 32 && (search.celled || search.stacked)) {
        if (search.celled)
          search.visitCells(sorted, query);
        else
          search.expandNode(levels, query, cell);
      }
      search.meetQueued();
    } while (search.queued || search.celled || search.stacked);
  }
  for (std::uint32_t i = lane; i < search.places.left; i += 32) search.places.at[i] = nothing_found;
}

}  // namespace

void findPairs(const CellStore& cells, const SearchRules& rules, ScenePlan* plan,
               const FoundPairs& found, std::uint32_t* counts, const KernelQueue& queue) {
  Tree tree;
  for (int level = 0; level < most_levels; ++level)
    tree.level[level] = recordsIn(cells.tree, cells.layout.records, cells.layout.begin[level]);
  const bool filtered = rules.filter.bits || rules.filter.bodies;
  const auto kernel = rules.exact ? filtered ? searchKernel<true, true> : searchKernel<true, false>
                      : filtered ? searchKernel<false, true>
                                  : searchKernel<false, false>;
  launch("find pairs", kernel, std::size_t(queue.processors) * search_blocks_a_processor,
         search_threads, queue.stream, recordsIn(cells.sorted, cells.boxes), tree, rules, plan,
         found, counts);
}

}  // namespace device
}  // namespace ode_parallel_sap
