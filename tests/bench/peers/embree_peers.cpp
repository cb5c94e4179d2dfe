// Embree's rtcCollide on a scene of user primitives, one a box. Commit rebuilds the hierarchy, by
// default with its medium quality; with the low one (Morton codes) it takes a fifth of the time and
// rtcCollide a quarter more.
#include <embree3/rtcore.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "../peer.h"
#include "../round_to_float.h"
#include "../stopwatch.h"

namespace bench {
namespace {

RTCDevice newEmbreeDevice(int threads) {
  const RTCDevice device = rtcNewDevice(("threads=" + std::to_string(threads)).c_str());
  if (!device) throw std::runtime_error("Embree: no device");
  return device;
}

class EmbreeScene {
 public:
  EmbreeScene() = default;
  ~EmbreeScene() {
    if (scene_) rtcReleaseScene(scene_);
    if (geometry_) rtcReleaseGeometry(geometry_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  void resize(std::size_t boxes) { bounds_.resize(boxes); }
  // Before build() or rebuild().
  void set(std::size_t box, int axis, double lower, double upper) {
    (&bounds_[box].lower_x)[axis] = floatBelow(lower);
    (&bounds_[box].upper_x)[axis] = floatAbove(upper);
  }

  void build(RTCDevice device, RTCBuildQuality quality) {
    scene_ = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene_, quality);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    geometry_ = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry_, quality);
    rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(bounds_.size()));
    rtcSetGeometryUserData(geometry_, bounds_.data());
    rtcSetGeometryBoundsFunction(geometry_, boundsOf, nullptr);
    rtcCommitGeometry(geometry_);
    rtcAttachGeometry(scene_, geometry_);
    rtcCommitScene(scene_);
  }
  RTCScene rebuild() {
    rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
    return scene_;
  }

  // A function for rtcCollide of a scene with itself, which several threads call at once, each time
  // with up to some dozen collisions: adds to a std::atomic<std::size_t>. A pair comes in one order
  // or both; the other order and a box with itself are dropped by their numbers.
  static void countWithin(void* pairs, RTCCollision* collisions, unsigned count) {
    std::size_t found = 0;
    for (unsigned i = 0; i < count; ++i) found += collisions[i].primID0 < collisions[i].primID1;
    static_cast<std::atomic<std::size_t>*>(pairs)->fetch_add(found, std::memory_order_relaxed);
  }

 private:
  static void boundsOf(const RTCBoundsFunctionArguments* arguments) {
    const auto* bounds = static_cast<const RTCBounds*>(arguments->geometryUserPtr);
    *arguments->bounds_o = bounds[arguments->primID];
  }

  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
  std::vector<RTCBounds> bounds_;
};

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

const AddPeers added([](std::vector<PeerKind>& kinds) {
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
});

}  // namespace
}  // namespace bench
