// Embree's rtcCollide on a scene of user primitives, one a box. Commit rebuilds the hierarchy, by
// default with its medium quality; with the low one (Morton codes) it takes a fifth of the time and
// rtcCollide a quarter more.
#include <embree3/rtcore.h>

#include <atomic>
#include <mutex>
#include <stdexcept>

#include "../peer.h"
#include "../round_to_float.h"

namespace bench {
namespace {

// rtcCollide calls these on several threads at once, each time with up to some dozen collisions. A
// pair comes in one order or both; the other order and a box with itself are dropped.
void countCollisions(void* pairs, RTCCollision* collisions, unsigned count) {
  std::size_t found = 0;
  for (unsigned i = 0; i < count; ++i) found += collisions[i].primID0 < collisions[i].primID1;
  static_cast<std::atomic<std::size_t>*>(pairs)->fetch_add(found, std::memory_order_relaxed);
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

void boundsOf(const RTCBoundsFunctionArguments* arguments) {
  const auto* bounds = static_cast<const RTCBounds*>(arguments->geometryUserPtr);
  *arguments->bounds_o = bounds[arguments->primID];
}

class EmbreePeer : public Peer {
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
    for (std::size_t i = 0; i < boxes.size(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        (&bounds_[i].lower_x)[axis] = floatBelow(boxes[i].low(axis));
        (&bounds_[i].upper_x)[axis] = floatAbove(boxes[i].high(axis));
      }
  }

  std::size_t find() override {
    std::atomic<std::size_t> pairs{0};
    collide(countCollisions, &pairs);
    return pairs;
  }

  void visit(const PairVisitor& visitor) override {
    Teller teller{{}, &visitor};
    collide(tellCollisions, &teller);
  }

 private:
  void collide(RTCCollideFunc report, void* data) {
    rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
    rtcCollide(scene_, scene_, report, data);
  }

  const RTCBuildQuality quality_;
  const RTCDevice device_;
  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
  std::vector<RTCBounds> bounds_;
};

template <RTCBuildQuality quality>
PeerKind kind(const char* name) {
  PeerKind kind;
  kind.name = name;
  kind.library = "Embree " RTC_VERSION_STRING;
  kind.takes_threads = true;
  kind.superset = "float bounds";
  kind.create = [](int threads) { return std::make_unique<EmbreePeer>(threads, quality); };
  return kind;
}

const AddPeers added([](std::vector<PeerKind>& kinds) {
  kinds.push_back(kind<RTC_BUILD_QUALITY_LOW>("embree"));
  kinds.push_back(kind<RTC_BUILD_QUALITY_MEDIUM>("embree-default"));
});

}  // namespace
}  // namespace bench
