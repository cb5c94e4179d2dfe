// cuBQL's trees on a device, from boxes in host memory to pairs in host memory: the tree is built
// anew, and each box looks in it for the boxes with a higher number.
#define CUBQL_GPU_BUILDER_IMPLEMENTATION 1
#include <cuBQL/bvh.h>
// The builders want that one first.
#include <cuBQL/builder/cuda/rebinMortonBuilder.h>
#include <cuBQL/traversal/fixedBoxQuery.h>

#include <memory>
#include <stdexcept>

#include "../peer.h"
#include "../round_to_float.h"

namespace bench {
namespace {

using cuBQL::box3f;
using cuBQL::bvh3f;

constexpr int query_threads = 128;
constexpr unsigned gathered_pairs = 12 * query_threads;
constexpr int boxes_of_leaf = 4;

void check(cudaError_t status) {
  if (status != cudaSuccess) throw std::runtime_error(cudaGetErrorString(status));
}

struct FreeOnDevice {
  void operator()(void* memory) const { cudaFree(memory); }
};
struct FreePinned {
  void operator()(void* memory) const { cudaFreeHost(memory); }
};
template <class T>
using OnDevice = std::unique_ptr<T[], FreeOnDevice>;
template <class T>
using Pinned = std::unique_ptr<T[], FreePinned>;

template <class T>
void allocate(OnDevice<T>& memory, std::size_t count) {
  void* fresh = nullptr;
  check(cudaMalloc(&fresh, count * sizeof(T)));
  memory.reset(static_cast<T*>(fresh));
}
template <class T>
void allocate(Pinned<T>& memory, std::size_t count) {
  void* fresh = nullptr;
  check(cudaMallocHost(&fresh, count * sizeof(T)));
  memory.reset(static_cast<T*>(fresh));
}

struct Pair {
  std::uint32_t lower, higher;
};
using Count = unsigned long long;

struct FoundPairs {
  Pair* pairs;
  Count room;
  Count* count;

  __device__ Count take(unsigned found) const { return atomicAdd(count, Count{found}); }
  __device__ void put(Count place, Pair pair) const {
    if (place < room) pairs[place] = pair;
  }
};

// Pairs of a block, gathered in its shared memory so that they leave it by one addition to the
// counter and in whole lines. Pairs that find no room there leave one by one.
struct Gathered {
  unsigned count;
  Count place;
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

// One thread a place among the tree's leaves, so that a warp's boxes are near each other. A leaf of
// one box has that box's bounds, and traversal has compared them.
__global__ void __launch_bounds__(query_threads)
    findPairs(bvh3f tree, const box3f* boxes, FoundPairs found) {
  __shared__ Gathered gathered;
  if (threadIdx.x == 0) gathered.count = 0;
  __syncthreads();
  const std::uint32_t at = blockIdx.x * query_threads + threadIdx.x;
  if (at < tree.numPrims) {
    const std::uint32_t lower = tree.primIDs[at];
    const box3f box = boxes[lower];
    const auto meetLeaf = [&](const std::uint32_t* numbers, std::uint32_t count) {
      for (std::uint32_t i = 0; i < count; ++i)
        if (numbers[i] > lower && (count == 1 || box.overlaps(boxes[numbers[i]])))
          gathered.add({lower, numbers[i]}, found);
      return CUBQL_CONTINUE_TRAVERSAL;
    };
    cuBQL::fixedBoxQuery::forEachLeaf(meetLeaf, tree, box);
  }
  gathered.leave(found);
}

enum class Builder { radix, rebin, median };

class CubqlPeer : public Peer {
 public:
  explicit CubqlPeer(Builder builder) : builder_(builder) {}

  void create(const Boxes& boxes) override {
    size_ = boxes.size();
    allocate(boxes_, size_);
    allocate(d_boxes_, size_);
    allocate(d_count_, 1);
    makeRoom(8 * size_);
    move(boxes);
  }
  void enter() override {}

  void move(const Boxes& boxes) override {
    for (std::size_t i = 0; i < size_; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        (&boxes_[i].lower.x)[axis] = floatBelow(boxes[i].low(axis));
        (&boxes_[i].upper.x)[axis] = floatAbove(boxes[i].high(axis));
      }
  }

  std::size_t find() override {
    check(cudaMemcpyAsync(d_boxes_.get(), boxes_.get(), size_ * sizeof(box3f),
                          cudaMemcpyHostToDevice));
    bvh3f tree;
    build(tree);
    Count count = query(tree);
    if (count > room_) {
      makeRoom(2 * count);
      count = query(tree);
    }
    cuBQL::cuda::free(tree);
    check(cudaMemcpy(pairs_.get(), d_pairs_.get(), count * sizeof(Pair), cudaMemcpyDeviceToHost));
    return count;
  }

  void visit(const PairVisitor& visitor) override {
    const std::size_t count = find();
    for (std::size_t i = 0; i < count; ++i) visitor(pairs_[i].lower, pairs_[i].higher);
  }

 private:
  void makeRoom(std::size_t pairs) {
    room_ = pairs;
    allocate(pairs_, room_);
    allocate(d_pairs_, room_);
  }

  void build(bvh3f& tree) {
    cuBQL::BuildConfig config;
    config.makeLeafThreshold = boxes_of_leaf;
    const auto size = static_cast<std::uint32_t>(size_);
    if (builder_ == Builder::radix)
      cuBQL::cuda::radixBuilder(tree, d_boxes_.get(), size, config);
    else if (builder_ == Builder::rebin)
      cuBQL::cuda::rebinRadixBuilder(tree, d_boxes_.get(), size, config);
    else
      cuBQL::gpuBuilder(tree, d_boxes_.get(), size, config);
  }

  Count query(const bvh3f& tree) {
    check(cudaMemsetAsync(d_count_.get(), 0, sizeof(Count)));
    const auto blocks = static_cast<unsigned>((size_ + query_threads - 1) / query_threads);
    findPairs<<<blocks, query_threads>>>(tree, d_boxes_.get(),
                                         {d_pairs_.get(), room_, d_count_.get()});
    check(cudaGetLastError());
    Count count = 0;
    check(cudaMemcpy(&count, d_count_.get(), sizeof count, cudaMemcpyDeviceToHost));
    return count;
  }

  const Builder builder_;
  std::size_t size_ = 0, room_ = 0;
  Pinned<box3f> boxes_;
  Pinned<Pair> pairs_;
  OnDevice<box3f> d_boxes_;
  OnDevice<Pair> d_pairs_;
  OnDevice<Count> d_count_;
};

template <Builder builder>
std::unique_ptr<Peer> createPeer(int) {
  int devices = 0;
  if (cudaGetDeviceCount(&devices) != cudaSuccess || devices == 0) return nullptr;
  return std::make_unique<CubqlPeer>(builder);
}

const AddPeers added([](std::vector<PeerKind>& kinds) {
  PeerKind kind;
  kind.library = "cuBQL, float";
  kind.superset = "float bounds";
  kind.name = "cubql-radix";
  kind.create = createPeer<Builder::radix>;
  kinds.push_back(kind);
  kind.name = "cubql-rebin";
  kind.create = createPeer<Builder::rebin>;
  kinds.push_back(kind);
  kind.name = "cubql-median";
  kind.create = createPeer<Builder::median>;
  kinds.push_back(kind);
});

}  // namespace
}  // namespace bench
