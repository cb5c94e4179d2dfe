// Boxes in a scene of Embree: one geometry of user primitives, one a box.
#pragma once

#include <embree3/rtcore.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <vector>

#include "../round_to_float.h"

namespace bench {

inline RTCDevice newEmbreeDevice(int threads) {
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

}  // namespace bench
