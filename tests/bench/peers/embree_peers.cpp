// Embree's rtcCollide on a scene of user primitives, one a box. Commit rebuilds the hierarchy, by
// default with its medium quality; with the low one (Morton codes) it takes a fifth of the time and
// rtcCollide a quarter more.
#include <embree3/rtcore.h>

#include <atomic>
#include <mutex>
#include <stdexcept>
#include <string>

#include "../peer.h"
#include "../round_to_float.h"
#include "../stopwatch.h"

namespace bench {
namespace {

void boundsOf(const RTCBoundsFunctionArguments* arguments) {
  const auto* bounds = static_cast<const RTCBounds*>(arguments->geometryUserPtr);
  *arguments->bounds_o = bounds[arguments->primID];
}

// Called by several threads at once, each time with up to some dozen collisions. A pair comes in
// one order or both; the other order and a box with itself are dropped by their numbers.
void countCollisions(void* data, RTCCollision* collisions, unsigned count) {
  std::size_t pairs = 0;
  for (unsigned i = 0; i < count; ++i) pairs += collisions[i].primID0 < collisions[i].primID1;
  static_cast<std::atomic<std::size_t>*>(data)->fetch_add(pairs, std::memory_order_relaxed);
}

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
      : quality_(quality), device_(rtcNewDevice(("threads=" + std::to_string(threads)).c_str())) {
    if (!device_) throw std::runtime_error("Embree: no device");
  }
  ~EmbreePeer() override {
    if (scene_) rtcReleaseScene(scene_);
    if (geometry_) rtcReleaseGeometry(geometry_);
    rtcReleaseDevice(device_);
  }

  void create(const Boxes& boxes) override {
    bounds_.resize(boxes.size());
    move(boxes);
  }

  void enter() override {
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, quality_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry_, quality_);
    rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(bounds_.size()));
    rtcSetGeometryUserData(geometry_, bounds_.data());
    rtcSetGeometryBoundsFunction(geometry_, boundsOf, nullptr);
    rtcCommitGeometry(geometry_);
    rtcAttachGeometry(scene_, geometry_);
    rtcCommitScene(scene_);
  }

  void move(const Boxes& boxes) override {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const CentredBox& box = boxes[i];
      RTCBounds& bounds = bounds_[i];
      bounds.lower_x = floatBelow(box.low(0));
      bounds.lower_y = floatBelow(box.low(1));
      bounds.lower_z = floatBelow(box.low(2));
      bounds.upper_x = floatAbove(box.high(0));
      bounds.upper_y = floatAbove(box.high(1));
      bounds.upper_z = floatAbove(box.high(2));
    }
  }

  std::size_t find() override {
    const Stopwatch clock;
    rebuild();
    update_ms_ = clock.milliseconds();
    std::atomic<std::size_t> pairs{0};
    rtcCollide(scene_, scene_, countCollisions, &pairs);
    extract_ms_ = clock.milliseconds() - update_ms_;
    return pairs;
  }

  void visit(const PairVisitor& visitor) override {
    rebuild();
    Teller teller{{}, &visitor};
    rtcCollide(scene_, scene_, tellCollisions, &teller);
  }

 private:
  void rebuild() {
    rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
  }

  const RTCBuildQuality quality_;
  RTCDevice device_;
  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
  std::vector<RTCBounds> bounds_;
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
