#include "cuda/one/search.h"
//
#include <algorithm>

#include "cuda/one/primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

// fixed: the spaces of a block's warps fit into the 48 kB of shared memory that every device has.
constexpr int search_warps = 8;
constexpr int search_threads = search_warps * 32;

// fixed: more hits of each queued box at once would not fit there. Half as many: 1.07 times the
// time.
constexpr int hits_at_once = 8;

// Levels with their numbers of records, in shared memory: indexed at run time.
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
  alignas(16) CoarseBox query[cell_size];
  Record bounds;  // the query's, of all its boxes
  CoarseScale scale;
  std::uint32_t stack[fan_out * (most_levels - 1)];
  uint2 cells[fan_out];                   // first place, number of boxes
  std::uint16_t hits[32 * hits_at_once];  // the queued box's lane, then the query's box
};

constexpr int level_shift = 28;  // fixed: nodes above the cells are fewer than 2^28

// Hands out places of `found` to a warp. All members are the same in all lanes.
struct Places {
  ScenePlan* plan;
  Found* found;
  unsigned long long capacity;
  Found* at = nullptr;
  std::uint32_t left = 0;

  // The place of the k-th of the next `count` pairs, at most chunk_places.
  __device__ Found* next(std::uint32_t k, std::uint32_t count, int lane) {
    Found* const own = at + k;
    if (count <= left) {
      at += count;
      left -= count;
      return own;
    }
    Found* const fresh = take(lane);
    const std::uint32_t there = count - left;
    Found* const place = k < left ? own : fresh + (k - left);
    at = fresh + there;
    left = chunk_places - there;
    return place;
  }

 private:
  // Places behind the capacity if it does not suffice.
  __device__ Found* take(int lane) {
    unsigned long long first = 0;
    if (lane == 0)
      first = atomicAdd(&plan->counters.found, static_cast<unsigned long long>(chunk_places));
    first = __shfl_sync(all_lanes, first, 0);
    return found + (first + chunk_places <= capacity ? first : capacity);
  }
};
static_assert(chunk_places >= 32, "a warp's hits fit into a chunk");

// Bits [begin, end) of 32.
__device__ std::uint32_t bitsWithin(int begin, int end) {
  const std::uint32_t below_end = static_cast<std::uint32_t>((1ull << min(max(end, 0), 32)) - 1);
  return below_end & ~static_cast<std::uint32_t>((1ull << min(max(begin, 0), 32)) - 1);
}

template <bool exact, bool filtered>
struct Search {
  WarpSpace& space;
  const SearchFilter filter;
  const Rows rows;
  Places places;
  std::uint32_t* const counts;
  const int lane;
  std::uint32_t query_count = 0;
  int queued = 0, own_left = 0, celled = 0, stacked = 0;

  // Whether two boxes may meet by their bits and bodies.
  __device__ bool passes(std::uint32_t slot, std::uint32_t other) const {
    if (filter.bits) {
      const uint2 own = filter.bits[slot], others = filter.bits[other];
      if (((own.x & others.y) | (own.y & others.x)) == 0) return false;
    }
    if (!filter.bodies) return true;
    const std::uint64_t body = filter.bodies[slot];
    return body == 0 || body != filter.bodies[other];
  }

  // Bit q: whether the query's box q may overlap. Bits of boxes that it has not are anything.
  __device__ std::uint32_t mayMeet(const CoarseBox& box) const {
    constexpr std::uint32_t at_once = 8;  // fixed: boxes tested between two branches
    std::uint32_t hits = 0;
    for (std::uint32_t first = 0; first < query_count; first += at_once) {
      const uint4* const pairs = reinterpret_cast<const uint4*>(space.query + first);
      std::uint32_t some = 0;
#pragma unroll
      for (std::uint32_t i = 0; i < at_once; i += 2) {
        const uint4 two = pairs[i / 2];
        if (mayOverlap(box, {two.x, two.y})) some |= 1u << i;
        if (mayOverlap(box, {two.z, two.w})) some |= 2u << i;
      }
      hits |= some << first;
    }
    return hits;
  }

  // Counts a pair of the earlier slot, if `meets`; returns how many were counted before. The lanes
  // `alike`, this one among them, count pairs of the same slot at once.
  __device__ std::uint32_t countPairs(bool meets, std::uint32_t earlier, std::uint32_t alike) {
    const int first = __ffs(alike) - 1;
    std::uint32_t before = 0;
    if (meets && lane == first) before = atomicAdd(&counts[earlier], __popc(alike));
    return __shfl_sync(all_lanes, before, first) + __popc(alike & ((1u << lane) - 1));
  }

  // Puts the pairs of lanes that have one beside the rows.
  __device__ void put(bool any, std::uint32_t earlier, std::uint32_t word) {
    const unsigned all = __ballot_sync(all_lanes, any);
    if (!all) return;
    Found* const to = places.next(__popc(all & ((1u << lane) - 1)), __popc(all), lane);
    if (any) *to = Found{earlier} << 32 | word;
  }

  // Lists some of the hits of each lane's queued box, which are taken out of `hits`, lane after
  // lane. Returns where the lane's are in the list.
  __device__ int2 listSome(std::uint32_t& hits) const {
    const int count = min(__popc(hits), hits_at_once);
    int end = count;
    for (int step = 1; step < 32; step *= 2) {
      const int below = __shfl_up_sync(all_lanes, end, step);
      if (lane >= step) end += below;
    }
    for (int i = end - count; i < end; ++i) {
      space.hits[i] = static_cast<std::uint16_t>(lane << 5 | (__ffs(hits) - 1));
      hits &= hits - 1;
    }
    __syncwarp();
    return {end - count, end};
  }

  // Writes the pairs of each lane's queued box, the first of which is at `first`, with those of the
  // query's boxes in `hits` that it overlaps: some of them, the others are returned. The lanes take
  // them all together, however many hits each box has.
  __device__ std::uint32_t writeSome(std::uint32_t hits, int first) {
    const int2 own = listSome(hits);
    const int total = __shfl_sync(all_lanes, own.y, 31);
    for (int from = 0; from < total; from += 32) {
      const int i = from + lane;
      const unsigned hit = space.hits[min(i, total - 1)];
      const int q = hit & 31, place = first + (hit >> 5);
      const float4 low = space.low[place], high = space.high[place];
      const float4 query_low = space.query_low[q], query_high = space.query_high[q];
      const std::uint32_t slot = __float_as_uint(low.w), other = __float_as_uint(query_low.w);
      const float depth = depthOf(query_low, query_high, low, high);
      bool meets = i < total && depth >= 0;
      if (filtered) meets = meets && passes(slot, other);
      const bool borderline = !exact && depth == 0;
      const std::uint32_t earlier = min(slot, other), word = max(slot, other) << 1 | borderline;
      const bool is_earlier = meets && slot < other;
      const unsigned earlier_ones = __ballot_sync(all_lanes, is_earlier);
      // The hits of the same queued box.
      const std::uint32_t range = __shfl_sync(all_lanes, own.x << 16 | own.y, hit >> 5);
      const std::uint32_t alike =
          bitsWithin(static_cast<int>(range >> 16) - from, static_cast<int>(range & 0xffff) - from);
      const std::uint32_t before =
          countPairs(meets, earlier, is_earlier ? earlier_ones & alike : 1u << lane);
      const bool in_row = before < rows.length;
      // Each slot has its row, and each place of it is given once.
      if (meets && in_row) rows.words[std::size_t{earlier} * rows.length + before] = word;
      put(meets && !in_row, earlier, word);
    }
    __syncwarp();
    return hits;
  }

  // One lane a box, the last ones of the queue: each meets all of the query's boxes. The first
  // `own_left` places of the queue are the query's own boxes: these meet those before them.
  __device__ void meetQueued() {
    __syncwarp();
    const int first = max(queued - 32, 0), place = first + lane;
    std::uint32_t hits = mayMeet(space.scale.coarse(space.low[place], space.high[place]));
    if (query_count < cell_size) hits &= (1u << query_count) - 1;
    if (place < own_left) hits &= (1u << place) - 1;
    if (place >= queued) hits = 0;
    while (__any_sync(all_lanes, hits)) hits = writeSome(hits, first);
    queued = first;
    own_left = min(own_left, first);
    __syncwarp();
  }

  // A cell is the query from now on; its own boxes are the first ones in the queue.
  __device__ void begin(const Record& query, const Records& sorted, int top_level) {
    const std::uint32_t start = __float_as_uint(query.low.w);
    query_count = __float_as_uint(query.high.w);
    Record own = {};
    if (lane < query_count) own = sorted[start + lane];
    space.query_low[lane] = space.low[lane] = own.low;
    space.query_high[lane] = space.high[lane] = own.high;
    const CoarseScale scale(query.low, query.high);
    space.query[lane] = scale.coarse(own.low, own.high);
    if (lane == 0) {
      space.bounds = query;
      space.scale = scale;
      space.stack[0] = static_cast<std::uint32_t>(top_level) << level_shift;
    }
    __syncwarp();
    queued = own_left = query_count;
    stacked = 1;
  }

  // Queues the boxes of the last queued cells that the query's bounds reach.
  __device__ void visitCells(const Records& sorted) {
    const Record query = space.bounds;
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
  __device__ void expandNode(const LevelTable& levels, std::uint32_t cell) {
    const Record query = space.bounds;
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

// Deals the cells of a part to the warps of a grid, by number. Three quarters are dealt in strides,
// so that a block's warps have neighbours, which reach the same boxes; the others to whoever is
// done, as how long one takes differs. Of 1,000,000 and 4,000,000 boxes the search takes 1.1 and
// 1.05 times the time with all in strides, 1.03 and 1.16 with all to whoever is done.
struct CellDealer {
  const Part part;
  const std::uint32_t stride, in_strides;

  __device__ CellDealer(const Part& part, std::uint32_t cells)
      : part(part), stride(gridDim.x * search_warps), in_strides(cells / part.count / 4 * 3) {}

  // The cell with that number in the part's row; there is none if it is not below their number, and
  // none behind it either. Neighbours go to the same part, as many as a block has warps.
  __device__ std::uint32_t cellOf(std::uint32_t dealt) const {
    const std::uint32_t group = dealt / search_warps * part.count + part.index;
    return group * search_warps + dealt % search_warps;
  }
  // The number that a warp gets after `dealt`; the same in all lanes.
  __device__ std::uint32_t after(std::uint32_t dealt, int lane, ScenePlan* plan) const {
    if (dealt + stride < in_strides) return dealt + stride;
    if (lane == 0) dealt = max(in_strides, stride) + atomicAdd(&plan->counters.cells_dealt, 1u);
    return __shfl_sync(all_lanes, dealt, 0);
  }
};

// One warp a cell. Levels, counts and nodes are those of the tree that plan->counters.cells gives;
// a child is read only below its level's count, a box only below its cell's.
template <bool exact, bool filtered>
__global__ void __launch_bounds__(search_threads, search_blocks_a_processor)
    searchKernel(const Records sorted, const Levels tree, SearchRules rules, ScenePlan* plan,
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
      levels.at[level] = tree.at[level];
      levels.count[level] = count;
      if (count <= fan_out && top_level < 0) top_level = level;
      count = (count + fan_out - 1) / fan_out;
    }
  }
  __syncthreads();
  Search<exact, filtered> search = {
      spaces[warp], rules.filter, found.rows, {plan, found.pairs, found.capacity}, counts, lane};

  const CellDealer dealer(rules.part, cell_count);
  std::uint32_t dealt = blockIdx.x * search_warps + warp;
  for (std::uint32_t cell; (cell = dealer.cellOf(dealt)) < cell_count;
       dealt = dealer.after(dealt, lane, plan)) {
    search.begin(tree.at[0][cell], sorted, top_level);
    do {
      while (search.queued < 32 && (search.celled || search.stacked)) {
        if (search.celled)
          search.visitCells(sorted);
        else
          search.expandNode(levels, cell);
      }
      search.meetQueued();
    } while (search.queued || search.celled || search.stacked);
  }
  for (std::uint32_t i = lane; i < search.places.left; i += 32) search.places.at[i] = nothing_found;
}

}  // namespace

void findPairs(const CellStore& cells, const SearchRules& rules, ScenePlan* plan,
               const FoundPairs& found, std::uint32_t* counts, const KernelQueue& queue) {
  const bool filtered = rules.filter.bits || rules.filter.bodies;
  const auto kernel = rules.exact ? filtered ? searchKernel<true, true> : searchKernel<true, false>
                      : filtered ? searchKernel<false, true>
                                  : searchKernel<false, false>;
  // No more than run at once: the cells that are not dealt in strides would be gone when the others
  // begin.
  int blocks = 0;
  CHECK_CUDA(cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags(&blocks, kernel, search_threads,
                                                                    0, cudaOccupancyDefault));
  blocks = std::min(std::max(blocks, 1), search_blocks_a_processor);
  launch("find pairs", kernel, std::size_t(queue.processors) * blocks, search_threads, queue.stream,
         recordsIn(cells.sorted, cells.boxes), Levels(cells), rules, plan, found, counts);
}

}  // namespace device
}  // namespace ode_parallel_sap
