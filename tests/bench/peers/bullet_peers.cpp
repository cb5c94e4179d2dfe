// Bullet's tree keeps its structure and its set of pairs from frame to frame.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>

#include "float_boxes.h"

namespace bench {
namespace {

btVector3 vector(const float* at) {
  return {at[0], at[1], at[2]};
}

class BulletPeer : public FloatPeer {
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

  void enter() override {
    for (const FloatBox& box : bounds_)
      proxies_.push_back(
          broad_phase_.createProxy(vector(box.low), vector(box.high), BOX_SHAPE_PROXYTYPE,
                                   reinterpret_cast<void*>(proxies_.size()), 1, 1, &dispatcher_));
  }

  // Told what its world would be told of: bodies that are awake.
  std::size_t find(const PairVisitor* visitor) override {
    for (const std::size_t i : moved_)
      broad_phase_.setAabb(proxies_[i], vector(bounds_[i].low), vector(bounds_[i].high),
                           &dispatcher_);
    moved_.clear();
    broad_phase_.calculateOverlappingPairs(&dispatcher_);
    btBroadphasePairArray& pairs =
        broad_phase_.getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; visitor && i < pairs.size(); ++i)
      (*visitor)(reinterpret_cast<std::size_t>(pairs[i].m_pProxy0->m_clientObject),
                 reinterpret_cast<std::size_t>(pairs[i].m_pProxy1->m_clientObject));
    return static_cast<std::size_t>(pairs.size());
  }

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broad_phase_;
  std::vector<btBroadphaseProxy*> proxies_;
};

const AddPeer added({"bullet-dbvt",
                     "Bullet " + std::to_string(BT_BULLET_VERSION / 100) + "." +
                         std::to_string(BT_BULLET_VERSION % 100) + ", float",
                     [](int) { return std::make_unique<BulletPeer>(); },
                     "boxes enlarged by a margin, pairs removed some frames late", false, 2000000});

}  // namespace
}  // namespace bench
