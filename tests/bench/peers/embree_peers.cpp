// Embree's rtcCollide on a scene of user primitives, one a box. Commit rebuilds the hierarchy, by
// default with its medium quality; with the low one (Morton codes) it takes a fifth of the time and
// rtcCollide a quarter more.
#include <embree3/rtcore.h>

#include <atomic>
#include <mutex>
#include <stdexcept>

#include "float_boxes.h"

namespace bench {
namespace {

struct Found {
  const PairVisitor* visitor;
  std::atomic<std::size_t> pairs{0};
  std::mutex mutex{};
};

// rtcCollide calls this on several threads at once, each time with up to some dozen collisions. A
// pair comes in one order or both; the other order and a box with itself are dropped.
void addCollisions(void* data, RTCCollision* collisions, unsigned count) {
  Found& found = *static_cast<Found*>(data);
  std::size_t pairs = 0;
  for (unsigned i = 0; i < count; ++i) pairs += collisions[i].primID0 < collisions[i].primID1;
  found.pairs.fetch_add(pairs, std::memory_order_relaxed);
  if (!found.visitor) return;
  const std::lock_guard<std::mutex> lock(found.mutex);
  for (unsigned i = 0; i < count; ++i)
    if (collisions[i].primID0 < collisions[i].primID1)
      (*found.visitor)(collisions[i].primID0, collisions[i].primID1);
}

void boundsOf(const RTCBoundsFunctionArguments* arguments) {
  const FloatBox& box = static_cast<const FloatBox*>(arguments->geometryUserPtr)[arguments->primID];
  for (int axis = 0; axis < 3; ++axis) {
    (&arguments->bounds_o->lower_x)[axis] = box.low[axis];
    (&arguments->bounds_o->upper_x)[axis] = box.high[axis];
  }
}

class EmbreePeer : public FloatPeer {
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

  void enter() override {
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, quality_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry_, quality_);
    rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(bounds_.size()));
    rtcSetGeometryUserData(geometry_, const_cast<FloatBox*>(bounds_.data()));
    rtcSetGeometryBoundsFunction(geometry_, boundsOf, nullptr);
    rtcCommitGeometry(geometry_);
    rtcAttachGeometry(scene_, geometry_);
    rtcCommitScene(scene_);
  }

  std::size_t find(const PairVisitor* visitor) override {
    rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
    Found found{visitor};
    rtcCollide(scene_, scene_, addCollisions, &found);
    return found.pairs;
  }

 private:
  const RTCBuildQuality quality_;
  const RTCDevice device_;
  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
};

template <RTCBuildQuality quality>
PeerKind kind(const char* name) {
  return {name, "Embree " RTC_VERSION_STRING,
          [](int threads) { return std::make_unique<EmbreePeer>(threads, quality); },
          "float bounds", true};
}

const AddPeer low(kind<RTC_BUILD_QUALITY_LOW>("embree"));
const AddPeer medium(kind<RTC_BUILD_QUALITY_MEDIUM>("embree-default"));

}  // namespace
}  // namespace bench
