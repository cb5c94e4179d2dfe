#include "cuda/one/classify.h"

#include "cuda/one/cell_cut.h"
#include "cuda/one/curve.h"
#include "cuda/one/primitives.cuh"

namespace ode_parallel_sap {
namespace device {

// Clusters are numbered by the place where they begin over cluster_size, which no two share.
struct Cluster {
  int low[3], high[3];  // of the centres, as ordered integers
  Curve curve;
  bool divisible;
};

namespace {

// In keys of 64 bits: the class, what was known before, the place on the cluster's curve.
constexpr int class_shift = 64 - class_digits;
constexpr int before_digits = class_shift - curve_digits;
static_assert(before_digits >= 28, "a place fits in front of the cluster's curve");

template <class Key>
__device__ int classOf(Key key) {
  return static_cast<int>(key >> (sizeof(Key) * 8 - class_digits));
}

// Where the cluster of place `i` begins, or `count` if it is in none.
template <class Key>
__device__ std::size_t clusterBegin(const Key* keys, std::size_t count, std::size_t i) {
  const std::size_t first = firstAlike(keys, i);
  return first + cluster_size < count && keys[first + cluster_size] == keys[i] ? first : count;
}

// One thread a cluster that there could be.
__global__ void __launch_bounds__(block_threads) clearKernel(Cluster* clusters, std::size_t most) {
  const std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x;
  if (i >= most) return;
  for (int axis = 0; axis < 3; ++axis) {
    clusters[i].low[axis] = ordered(INFINITY);
    clusters[i].high[axis] = ordered(-INFINITY);
  }
}

// One thread a place below plan->active; lanes of the same cluster join before they add.
template <class Key>
__global__ void __launch_bounds__(block_threads)
    rangeKernel(OrderedBoxes boxes, const Key* keys, const ScenePlan* plan, Cluster* clusters) {
  const std::size_t active = plan->active;
  const std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x;
  const std::size_t begin = i < active ? clusterBegin(keys, active, i) : active;
  const unsigned cluster = static_cast<unsigned>(begin / cluster_size);
  const bool member = begin < active;
  float centre[3] = {NAN, NAN, NAN};
  if (member) {
    const Record box = loadBox(boxes.boxes, boxes.slots[i]);
    centre[0] = centreOf(box.low.x, box.high.x);
    centre[1] = centreOf(box.low.y, box.high.y);
    centre[2] = centreOf(box.low.z, box.high.z);
  }
  const unsigned first = __shfl_sync(all_lanes, cluster, 0);
  const bool together = __all_sync(all_lanes, member && cluster == first);
  for (int axis = 0; axis < 3; ++axis) {
    const bool finite = isfinite(centre[axis]);
    int low = ordered(finite ? centre[axis] : INFINITY);
    int high = ordered(finite ? centre[axis] : -INFINITY);
    if (together) {
      low = warpMin(low);
      high = warpMax(high);
    }
    if (!member || (together && threadIdx.x % 32)) continue;
    atomicMin(&clusters[cluster].low[axis], low);
    atomicMax(&clusters[cluster].high[axis], high);
  }
}

// One thread a place: the first of each cluster chooses its curve. Clears plan->counters.clustered,
// which a divisible cluster sets again.
template <class Key>
__global__ void __launch_bounds__(block_threads)
    curveKernel(const Key* keys, ScenePlan* plan, Cluster* clusters) {
  const std::size_t active = plan->active;
  const std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x;
  if (i >= active || (i && keys[i - 1] == keys[i])) return;
  if (i + cluster_size >= active || keys[i + cluster_size] != keys[i]) return;
  Cluster& cluster = clusters[i / cluster_size];
  cluster.divisible = false;
  for (int axis = 0; axis < 3; ++axis)
    if (cluster.low[axis] < cluster.high[axis] &&
        unordered(cluster.low[axis]) < unordered(cluster.high[axis]))
      cluster.divisible = true;
  if (!cluster.divisible) return;
  cluster.curve.choose(cluster.low, cluster.high, plan->summary[classOf(keys[i])].extent,
                       curve_digits);
  for (int axis = 0; axis < 3; ++axis) cluster.curve.chooseSpread(axis, curve_digits);
  plan->counters.clustered = 1;
}

// One thread a place. Keys of 32 bits are kept, those of 64 are replaced by the place where the
// cluster begins, or the own one. Inactive boxes stay last.
template <class Key>
__global__ void __launch_bounds__(block_threads)
    divideKernel(OrderedBoxes boxes, const Key* keys, const ScenePlan* plan,
                 const Cluster* clusters, std::uint64_t* new_keys) {
  const std::size_t active = plan->active;
  const std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x;
  if (i >= boxes.count) return;
  if (i >= active) {
    new_keys[i] = ~std::uint64_t{0};
    return;
  }
  const std::size_t begin = clusterBegin(keys, active, i);
  std::uint64_t place = 0;
  if (begin < active && clusters[begin / cluster_size].divisible)
    place = clusters[begin / cluster_size].curve.keyOf(loadBox(boxes.boxes, boxes.slots[i]));
  const std::uint64_t before = sizeof(Key) == 4
                                   ? std::uint64_t{keys[i]} << 32
                                   : std::uint64_t(classOf(keys[i])) << class_shift |
                                         std::uint64_t{begin < active ? begin : i} << curve_digits;
  new_keys[i] = before | place;
}

}  // namespace

template <class Key>
bool divideClusters(const OrderedBoxes& boxes, const Key* keys, ScenePlan* plan,
                    std::uint64_t* new_keys, const ScratchQueue& queue) {
  const cudaStream_t stream = queue.stream;
  const std::size_t most = boxes.count / cluster_size + 1, blocks = blocksForAll(boxes.count);
  queue.scratch.reserve(most * sizeof(Cluster));
  Cluster* const clusters = reinterpret_cast<Cluster*>(queue.scratch.data());
  std::uint32_t* const clustered = &plan->counters.clustered;
  launch("clear clusters", clearKernel, blocksForAll(most), block_threads, stream, clusters, most);
  launch("find ranges", rangeKernel<Key>, blocks, block_threads, stream, boxes, keys, plan,
         clusters);
  CHECK_CUDA(cudaMemsetAsync(clustered, 0, sizeof *clustered, stream));
  launch("choose curves", curveKernel<Key>, blocks, block_threads, stream, keys, plan, clusters);
  launch("divide clusters", divideKernel<Key>, blocks, block_threads, stream, boxes, keys, plan,
         clusters, new_keys);
  std::uint32_t divisible = 0;
  CHECK_CUDA(
      cudaMemcpyAsync(&divisible, clustered, sizeof divisible, cudaMemcpyDeviceToHost, stream));
  CHECK_CUDA(cudaMemsetAsync(clustered, 0, sizeof *clustered, stream));
  CHECK_CUDA(cudaStreamSynchronize(stream));
  return divisible != 0;
}
template bool divideClusters(const OrderedBoxes&, const std::uint32_t*, ScenePlan*, std::uint64_t*,
                             const ScratchQueue&);
template bool divideClusters(const OrderedBoxes&, const std::uint64_t*, ScenePlan*, std::uint64_t*,
                             const ScratchQueue&);

}  // namespace device
}  // namespace ode_parallel_sap
