// Scalable-CCD's sweep and prune, which sorts along one axis, the one of the largest variance in
// the call before, and sweeps on all threads. It takes its boxes by value; the copy is its own.
#include <tbb/task_arena.h>

#include <scalable_ccd/broad_phase/sort_and_sweep.hpp>
#include <scalable_ccd/config.hpp>

#include "../peer.h"

namespace bench {
namespace {

using scalable_ccd::AABB;

class ScalableCcdPeer : public Peer {
 public:
  explicit ScalableCcdPeer(int threads) : arena_(threads) {}

  void create(const Boxes& boxes) override {
    boxes_.resize(boxes.size());
    move(boxes);
    // Meshes have corners in common, which these boxes have not.
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      const long number = static_cast<long>(i);
      boxes_[i].vertex_ids = {number, -number - 1, -number - 1};
      boxes_[i].element_id = number;
    }
  }

  void enter() override {}

  void move(const Boxes& boxes) override {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      AABB& box = boxes_[i];
      box.min.resize(3);
      box.max.resize(3);
      for (int axis = 0; axis < 3; ++axis) {
        box.min[axis] = boxes[i].low(axis);
        box.max[axis] = boxes[i].high(axis);
      }
    }
  }

  std::size_t find() override {
    arena_.execute([this] { scalable_ccd::sort_and_sweep(boxes_, axis_, pairs_); });
    return pairs_.size();
  }

  void visit(const PairVisitor& visitor) override {
    find();
    for (const auto& [first, second] : pairs_)
      visitor(static_cast<std::size_t>(first), static_cast<std::size_t>(second));
  }

 private:
  tbb::task_arena arena_;
  std::vector<AABB> boxes_;
  int axis_ = 0;
  std::vector<std::pair<int, int>> pairs_;
};

const AddPeers added([](std::vector<PeerKind>& kinds) {
  PeerKind kind;
  kind.name = "scalable-ccd";
  kind.library = "Scalable-CCD " SCALABLE_CCD_VER ", double precision";
  kind.takes_threads = true;
  kind.create = [](int threads) { return std::make_unique<ScalableCcdPeer>(threads); };
  kinds.push_back(kind);
});

}  // namespace
}  // namespace bench
