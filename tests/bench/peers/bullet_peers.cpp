// Bullet's tree keeps its structure and its set of pairs from frame to frame.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>

#include "../peer.h"
#include "../round_to_float.h"

namespace bench {
namespace {

btVector3 lowOf(const CentredBox& box) {
  return {floatBelow(box.low(0)), floatBelow(box.low(1)), floatBelow(box.low(2))};
}

btVector3 highOf(const CentredBox& box) {
  return {floatAbove(box.high(0)), floatAbove(box.high(1)), floatAbove(box.high(2))};
}

class BulletPeer : public Peer {
 public:
  ~BulletPeer() override {
    // A proxy takes a pass over all pairs to destroy; the pairs are worth nothing any more.
    btOverlappingPairCache* cache = broad_phase_.getOverlappingPairCache();
    while (cache->getNumOverlappingPairs() > 0) {
      const btBroadphasePair pair =
          cache->getOverlappingPairArrayPtr()[cache->getNumOverlappingPairs() - 1];
      cache->removeOverlappingPair(pair.m_pProxy0, pair.m_pProxy1, &dispatcher_);
    }
  }

  void create(const Boxes& boxes) override { move(boxes); }

  void enter() override {
    proxies_.reserve(low_.size());
    for (std::size_t i = 0; i < low_.size(); ++i) {
      proxies_.push_back(broad_phase_.createProxy(low_[i], high_[i], BOX_SHAPE_PROXYTYPE,
                                                  reinterpret_cast<void*>(i), 1, 1, &dispatcher_));
    }
  }

  void move(const Boxes& boxes) override {
    low_.resize(boxes.size());
    high_.resize(boxes.size());
    moved_.clear();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const btVector3 low = lowOf(boxes[i]), high = highOf(boxes[i]);
      if (low == low_[i] && high == high_[i]) continue;
      low_[i] = low;
      high_[i] = high;
      moved_.push_back(i);
    }
  }

  std::size_t find() override {
    for (const std::size_t i : moved_)
      broad_phase_.setAabb(proxies_[i], low_[i], high_[i], &dispatcher_);
    moved_.clear();
    broad_phase_.calculateOverlappingPairs(&dispatcher_);
    return static_cast<std::size_t>(
        broad_phase_.getOverlappingPairCache()->getNumOverlappingPairs());
  }

  void visit(const PairVisitor& visitor) override {
    find();
    btBroadphasePairArray& pairs =
        broad_phase_.getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
      visitor(reinterpret_cast<std::size_t>(pairs[i].m_pProxy0->m_clientObject),
              reinterpret_cast<std::size_t>(pairs[i].m_pProxy1->m_clientObject));
  }

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broad_phase_;
  std::vector<btBroadphaseProxy*> proxies_;
  std::vector<btVector3> low_, high_;
  std::vector<std::size_t> moved_;  // what its world would be told of: bodies that are awake
};

const AddPeers added([](std::vector<PeerKind>& kinds) {
  PeerKind kind;
  kind.name = "bullet-dbvt";
  kind.library = "Bullet " + std::to_string(BT_BULLET_VERSION / 100) + "." +
                 std::to_string(BT_BULLET_VERSION % 100) + ", float";
  kind.most = 2000000;
  kind.superset = "boxes enlarged by a margin, pairs removed some frames late";
  kind.create = [](int) { return std::make_unique<BulletPeer>(); };
  kinds.push_back(kind);
});

}  // namespace
}  // namespace bench
