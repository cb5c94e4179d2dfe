// Box3D keeps a dynamic tree of enlarged boxes, in which it looks for the pairs of what left its
// enlarged box, and a contact for each pair.
#include <memory>

#include "../peer.h"
#include "../round_to_float.h"
#include "box3d_world.h"
#include "moved_boxes.h"

namespace bench {
namespace {

BenchBox3dBounds boundsOf(const CentredBox& box) {
  BenchBox3dBounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    bounds.low[axis] = floatBelow(box.low(axis));
    bounds.high[axis] = floatAbove(box.high(axis));
  }
  return bounds;
}

void tell(void* data, int first, int second) {
  (*static_cast<const PairVisitor*>(data))(static_cast<std::size_t>(first),
                                           static_cast<std::size_t>(second));
}

class Box3dPeer : public Peer {
 public:
  explicit Box3dPeer(int threads) : threads_(threads) {}

  void create(const Boxes& boxes) override { boxes_.create(boxes); }

  void enter() override {
    world_.reset(
        benchBox3dCreate(boxes_.bounds().data(), static_cast<int>(boxes_.size()), threads_));
  }

  void move(const Boxes& boxes) override {
    boxes_.move(boxes);
    moved_.assign(boxes_.moved().begin(), boxes_.moved().end());
  }

  std::size_t find() override {
    const int pairs = benchBox3dUpdate(world_.get(), boxes_.bounds().data(), moved_.data(),
                                       static_cast<int>(moved_.size()));
    moved_.clear();
    return static_cast<std::size_t>(pairs);
  }

  void visit(const PairVisitor& visitor) override {
    find();
    benchBox3dVisit(world_.get(), tell, const_cast<PairVisitor*>(&visitor));
  }

 private:
  struct Destroy {
    void operator()(BenchBox3d* world) const { benchBox3dDestroy(world); }
  };

  const int threads_;
  MovedBoxes<BenchBox3dBounds> boxes_{boundsOf};
  std::vector<int> moved_;
  std::unique_ptr<BenchBox3d, Destroy> world_;
};

const AddPeers added([](std::vector<PeerKind>& kinds) {
  PeerKind kind;
  kind.name = "box3d";
  kind.library = "Box3D, float";
  kind.takes_threads = true;
  kind.superset = "boxes enlarged by a margin";
  kind.create = [](int threads) { return std::make_unique<Box3dPeer>(threads); };
  kinds.push_back(kind);
});

}  // namespace
}  // namespace bench
