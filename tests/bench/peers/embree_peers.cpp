// Embree's rtcCollide on a scene of user primitives, one a box. Commit rebuilds the hierarchy, by
// default with its medium quality; with the low one (Morton codes) it takes a fifth of the time and
// rtcCollide a quarter more.
#include <atomic>
#include <mutex>
#include <optional>

#include "../peer.h"
#include "../stopwatch.h"
#include "embree_scene.h"

namespace bench {
namespace {

struct Teller {
  std::mutex mutex;
  const PairVisitor* visitor;
};

void tellCollisions(void* data, RTCCollision* collisions, unsigned count) {
  Teller& teller = *static_cast<Teller*>(data);
  const std::lock_guard<std::mutex> lock(teller.mutex);
  for (unsigned i = 0; i < count; ++i)
    if (collisions[i].primID0 < collisions[i].primID1)
      (*teller.visitor)(collisions[i].primID0, collisions[i].primID1);
}

class EmbreePeer : public TwoStepPeer {
 public:
  EmbreePeer(int threads, RTCBuildQuality quality)
      : quality_(quality), device_(newEmbreeDevice(threads)) {}
  ~EmbreePeer() override {
    scene_.reset();
    rtcReleaseDevice(device_);
  }

  void create(const Boxes& boxes) override {
    scene_.emplace();
    scene_->resize(boxes.size());
    move(boxes);
  }

  void enter() override { scene_->build(device_, quality_); }

  void move(const Boxes& boxes) override {
    for (std::size_t i = 0; i < boxes.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        scene_->set(i, axis, boxes[i].low(axis), boxes[i].high(axis));
  }

  std::size_t find() override {
    const Stopwatch clock;
    const RTCScene scene = scene_->rebuild();
    update_ms_ = clock.milliseconds();
    std::atomic<std::size_t> pairs{0};
    rtcCollide(scene, scene, EmbreeScene::countWithin, &pairs);
    extract_ms_ = clock.milliseconds() - update_ms_;
    return pairs;
  }

  void visit(const PairVisitor& visitor) override {
    const RTCScene scene = scene_->rebuild();
    Teller teller{{}, &visitor};
    rtcCollide(scene, scene, tellCollisions, &teller);
  }

 private:
  const RTCBuildQuality quality_;
  RTCDevice device_;
  std::optional<EmbreeScene> scene_;
};

}  // namespace

void addEmbreePeers(std::vector<PeerKind>& kinds) {
  PeerKind kind;
  kind.name = "embree";
  kind.library = "Embree " RTC_VERSION_STRING;
  kind.takes_threads = true;
  kind.superset = "float bounds";
  kind.create = [](int threads) {
    return std::make_unique<EmbreePeer>(threads, RTC_BUILD_QUALITY_LOW);
  };
  kinds.push_back(kind);
  kind.name = "embree-default";
  kind.create = [](int threads) {
    return std::make_unique<EmbreePeer>(threads, RTC_BUILD_QUALITY_MEDIUM);
  };
  kinds.push_back(kind);
}

}  // namespace bench
