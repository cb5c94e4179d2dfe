#include "tests/bench/devices/cubql_pairs.h"
//
#define CUBQL_GPU_BUILDER_IMPLEMENTATION 1
#include <cuBQL/bvh.h>
//
#include <cuBQL/builder/cuda/rebinMortonBuilder.h>
#include <cuBQL/traversal/fixedBoxQuery.h>

#include <algorithm>
#include <stdexcept>

#include "cuda/device/device.h"
#include "tests/bench/stopwatch.h"

namespace bench {

using namespace ode_parallel_sap;
using cuBQL::box3f;
using cuBQL::bvh3f;
static_assert(sizeof(box3f) == sizeof(Box), "boxes are copied as they are");

namespace {

constexpr int query_threads = 128;
constexpr unsigned gathered_pairs = 12 * query_threads;

struct FoundPairs {
  Pair* pairs;
  unsigned long long room;
  unsigned long long* count;

  __device__ unsigned long long take(unsigned pairs_found) const {
    return atomicAdd(count, static_cast<unsigned long long>(pairs_found));
  }
  __device__ void put(unsigned long long place, Pair pair) const {
    if (place < room) pairs[place] = pair;
  }
};

// Pairs of a block, gathered in its shared memory so that they leave it by one addition to the
// counter and in whole lines. Those that find no room there leave one by one.
struct Gathered {
  unsigned count;
  unsigned long long place;
  Pair pairs[gathered_pairs];

  __device__ void add(Pair pair, const FoundPairs& found) {
    const unsigned at = atomicAdd(&count, 1u);
    if (at < gathered_pairs)
      pairs[at] = pair;
    else
      found.put(found.take(1), pair);
  }
  // By all threads of the block.
  __device__ void leave(const FoundPairs& found) {
    __syncthreads();
    const unsigned kept = min(count, gathered_pairs);
    if (threadIdx.x == 0) place = found.take(kept);
    __syncthreads();
    for (unsigned i = threadIdx.x; i < kept; i += query_threads) found.put(place + i, pairs[i]);
  }
};

// One thread a place [begin, end) among the tree's leaves, so that a warp's boxes are near each
// other. It finds the pairs in which its box has the earlier slot. A leaf of one box has that box's
// bounds, and traversal has compared them.
__global__ void __launch_bounds__(query_threads)
    findPairs(bvh3f tree, const box3f* boxes, std::uint32_t begin, std::uint32_t end,
              FoundPairs found) {
  __shared__ Gathered gathered;
  if (threadIdx.x == 0) gathered.count = 0;
  __syncthreads();
  const std::uint32_t at = begin + blockIdx.x * query_threads + threadIdx.x;
  if (at < end) {
    const std::uint32_t earlier = tree.primIDs[at];
    const box3f box = boxes[earlier];
    const auto meetLeaf = [&](const std::uint32_t* slots, std::uint32_t count) {
      for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t later = slots[i];
        if (later > earlier && (count == 1 || box.overlaps(boxes[later])))
          gathered.add(Pair{earlier} << 32 | later, found);  // makePair
      }
      return CUBQL_CONTINUE_TRAVERSAL;
    };
    cuBQL::fixedBoxQuery::forEachLeaf(meetLeaf, tree, box);
  }
  gathered.leave(found);
}

// Into pinned memory. A copy would have to wait for the pairs that are leaving.
__global__ void tellCount(const unsigned long long* count, unsigned long long* host_count) {
  *host_count = *count;
}

void buildTree(bvh3f& tree, const box3f* boxes, std::size_t count, const CubqlSetting& setting,
               cudaStream_t stream) {
  cuBQL::BuildConfig config;
  config.makeLeafThreshold = setting.leaf;
  const auto number = static_cast<std::uint32_t>(count);
  if (setting.builder == "radix") {
    cuBQL::cuda::radixBuilder(tree, boxes, number, config, stream);
  } else if (setting.builder == "rebin") {
    cuBQL::cuda::rebinRadixBuilder(tree, boxes, number, config, stream);
  } else if (setting.builder == "median" || setting.builder == "sah") {
    if (setting.builder == "sah") config.buildMethod = cuBQL::BuildConfig::SAH;
    cuBQL::gpuBuilder(tree, boxes, number, config, stream);
  } else {
    throw std::invalid_argument("cuBQL has no builder " + setting.builder);
  }
}

float msBetween(const Event& begin, const Event& end) {
  float ms = 0;
  CHECK_CUDA(cudaEventElapsedTime(&ms, begin, end));
  return ms;
}

}  // namespace

const std::vector<std::string>& cubqlBuilders() {
  static const std::vector<std::string> all = {"radix", "rebin", "median", "sah"};
  return all;
}

struct CubqlPairs::State {
  State(const BoxSet& from, std::size_t pairs) : size(from.size), room(pairs) {
    boxes.reserve(size);
    host_boxes.reserve(size);
    found.reserve(room);
    host_found.reserve(room);
    count.reserve(1);
    std::copy(from.boxes.begin(), from.boxes.begin() + size, host_boxes.data());
  }
  // From [begin, end) of the boxes, and their number to the host after that.
  void query(const bvh3f& tree, std::uint32_t begin, std::uint32_t end, std::size_t piece) {
    const FoundPairs to = {found.data(), room, count.data()};
    const std::uint32_t blocks = (end - begin + query_threads - 1) / query_threads;
    if (blocks)
      findPairs<<<blocks, query_threads, 0, stream>>>(
          tree, reinterpret_cast<const box3f*>(boxes.data()), begin, end, to);
    tellCount<<<1, 1, 0, stream>>>(count.data(), &host_counts[piece]);
    CHECK_CUDA(cudaGetLastError());
    CHECK_CUDA(cudaEventRecord(*counted[piece], stream));
  }
  // Each piece's pairs as soon as their number is known.
  void fetch(std::size_t pieces) {
    std::size_t fetched = 0;
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      CHECK_CUDA(cudaEventSynchronize(*counted[piece]));
      const std::size_t known = std::min<std::size_t>(host_counts[piece], room);
      if (known > fetched)
        CHECK_CUDA(cudaMemcpyAsync(host_found.data() + fetched, found.data() + fetched,
                                   (known - fetched) * sizeof(Pair), cudaMemcpyDeviceToHost, down));
      fetched = known;
    }
    CHECK_CUDA(cudaEventRecord(downloaded, down));
    CHECK_CUDA(cudaStreamSynchronize(down));
    number = host_counts[pieces - 1];
  }

  const std::size_t size, room;
  std::size_t number = 0;
  DeviceBuffer<Box> boxes;
  DeviceBuffer<Pair> found;
  DeviceBuffer<unsigned long long> count;
  PinnedBuffer<Box> host_boxes;
  PinnedBuffer<Pair> host_found;
  PinnedBuffer<unsigned long long> host_counts;
  std::vector<std::unique_ptr<Event>> counted;
  Event begun{Event::Time}, uploaded{Event::Time}, built{Event::Time}, queried{Event::Time},
      downloaded{Event::Time};
  Stream stream, down;
};

CubqlPairs::CubqlPairs(const BoxSet& boxes, std::size_t room)
    : state_(std::make_unique<State>(boxes, room)) {}
CubqlPairs::~CubqlPairs() = default;

double CubqlPairs::find(const CubqlSetting& setting) {
  State& s = *state_;
  const auto pieces = static_cast<std::size_t>(setting.pieces);
  s.host_counts.reserve(pieces);
  while (s.counted.size() < pieces) s.counted.push_back(std::make_unique<Event>());
  bvh3f tree;

  const Stopwatch watch;
  CHECK_CUDA(cudaEventRecord(s.begun, s.stream));
  CHECK_CUDA(cudaMemsetAsync(s.count.data(), 0, sizeof(unsigned long long), s.stream));
  CHECK_CUDA(cudaMemcpyAsync(s.boxes.data(), s.host_boxes.data(), s.size * sizeof(Box),
                             cudaMemcpyHostToDevice, s.stream));
  CHECK_CUDA(cudaEventRecord(s.uploaded, s.stream));
  buildTree(tree, reinterpret_cast<const box3f*>(s.boxes.data()), s.size, setting, s.stream);
  CHECK_CUDA(cudaEventRecord(s.built, s.stream));
  for (std::size_t piece = 0; piece < pieces; ++piece)
    s.query(tree, static_cast<std::uint32_t>(tree.numPrims * piece / pieces),
            static_cast<std::uint32_t>(tree.numPrims * (piece + 1) / pieces), piece);
  CHECK_CUDA(cudaEventRecord(s.queried, s.stream));
  s.fetch(pieces);
  const double taken = watch.milliseconds();
  cuBQL::cuda::free(tree, s.stream);
  return taken;
}

const Pair* CubqlPairs::pairs() const {
  return state_->host_found.data();
}
std::size_t CubqlPairs::found() const {
  return state_->number;
}
CubqlTimes CubqlPairs::times() const {
  const State& s = *state_;
  return {msBetween(s.begun, s.uploaded), msBetween(s.uploaded, s.built),
          msBetween(s.built, s.queried), msBetween(s.queried, s.downloaded)};
}

}  // namespace bench
