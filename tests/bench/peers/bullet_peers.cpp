// Bullet's broad phases keep their structure and their set of pairs from frame to frame.
#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>

#include <algorithm>

#include "../peer.h"
#include "../round_to_float.h"
#include "../stopwatch.h"

namespace bench {
namespace {

btVector3 lowOf(const CentredBox& box) {
  return {floatBelow(box.low(0)), floatBelow(box.low(1)), floatBelow(box.low(2))};
}

btVector3 highOf(const CentredBox& box) {
  return {floatAbove(box.high(0)), floatAbove(box.high(1)), floatAbove(box.high(2))};
}

class BulletPeer : public TwoStepPeer {
 public:
  ~BulletPeer() override {
    // A proxy takes a pass over all pairs to destroy; the pairs are worth nothing any more.
    if (broad_phase_) {
      btOverlappingPairCache* cache = broad_phase_->getOverlappingPairCache();
      while (cache->getNumOverlappingPairs() > 0) {
        const btBroadphasePair pair =
            cache->getOverlappingPairArrayPtr()[cache->getNumOverlappingPairs() - 1];
        cache->removeOverlappingPair(pair.m_pProxy0, pair.m_pProxy1, &dispatcher_);
      }
    }
  }

  void create(const Boxes& boxes) override {
    extent_ = extentOf(boxes);
    move(boxes);
  }

  void enter() override {
    broad_phase_ = createBroadPhase(extent_, low_.size());
    proxies_.reserve(low_.size());
    for (std::size_t i = 0; i < low_.size(); ++i) {
      proxies_.push_back(broad_phase_->createProxy(low_[i], high_[i], BOX_SHAPE_PROXYTYPE,
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
    const Stopwatch clock;
    for (const std::size_t i : moved_)
      broad_phase_->setAabb(proxies_[i], low_[i], high_[i], &dispatcher_);
    moved_.clear();
    update_ms_ = clock.milliseconds();
    broad_phase_->calculateOverlappingPairs(&dispatcher_);
    extract_ms_ = clock.milliseconds() - update_ms_;
    return static_cast<std::size_t>(
        broad_phase_->getOverlappingPairCache()->getNumOverlappingPairs());
  }

  void visit(const PairVisitor& visitor) override {
    find();
    btBroadphasePairArray& pairs =
        broad_phase_->getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i)
      visitor(reinterpret_cast<std::size_t>(pairs[i].m_pProxy0->m_clientObject),
              reinterpret_cast<std::size_t>(pairs[i].m_pProxy1->m_clientObject));
  }

 protected:
  virtual std::unique_ptr<btBroadphaseInterface> createBroadPhase(const Extent& extent,
                                                                  std::size_t count) = 0;

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  std::unique_ptr<btBroadphaseInterface> broad_phase_;
  std::vector<btBroadphaseProxy*> proxies_;
  std::vector<btVector3> low_, high_;
  std::vector<std::size_t> moved_;  // what its world would be told of: bodies that are awake
  Extent extent_;
};

class DbvtPeer : public BulletPeer {
  std::unique_ptr<btBroadphaseInterface> createBroadPhase(const Extent&, std::size_t) override {
    return std::make_unique<btDbvtBroadphase>();
  }
};

class AxisSweepPeer : public BulletPeer {
  std::unique_ptr<btBroadphaseInterface> createBroadPhase(const Extent& extent,
                                                          std::size_t count) override {
    // The world's bounds cannot be changed later: room for what moves out.
    btVector3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const double room = (extent.high[axis] - extent.low[axis]) / 4 + 1;
      low[axis] = static_cast<float>(extent.low[axis] - room);
      high[axis] = static_cast<float>(extent.high[axis] + room);
    }
    if (count <= 16000)
      return std::make_unique<btAxisSweep3>(low, high, static_cast<unsigned short>(count + 2));
    return std::make_unique<bt32BitAxisSweep3>(low, high, static_cast<unsigned>(count + 2));
  }
};

template <class T>
PeerKind kind(const char* name, std::size_t most, const char* superset) {
  PeerKind kind;
  kind.name = name;
  kind.library = "Bullet " + std::to_string(BT_BULLET_VERSION / 100) + "." +
                 std::to_string(BT_BULLET_VERSION % 100) + ", float";
  kind.most = most;
  kind.superset = superset;
  kind.create = [](int) { return std::make_unique<T>(); };
  return kind;
}

const AddPeers added([](std::vector<PeerKind>& kinds) {
  kinds.push_back(kind<DbvtPeer>("bullet-dbvt", 2000000,
                                 "boxes enlarged by a margin, pairs removed some frames late"));
  // Creating the proxies takes quadratic time.
  kinds.push_back(kind<AxisSweepPeer>("bullet-axis-sweep", 30000, "bounds rounded to a grid"));
});

}  // namespace
}  // namespace bench
