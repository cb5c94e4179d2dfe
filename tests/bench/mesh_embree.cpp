// Boxes of meshes in scenes of Embree, a group each.
#include <embree3/rtcore.h>

#include <atomic>
#include <stdexcept>

#include "mesh_finder.h"
#include "round_to_float.h"
#include "stopwatch.h"

namespace bench {
namespace {

void boundsOf(const RTCBoundsFunctionArguments* arguments) {
  *arguments->bounds_o =
      static_cast<const RTCBounds*>(arguments->geometryUserPtr)[arguments->primID];
}

// Within one scene a pair comes in one order or both, and a box meets itself.
void countWithin(void* data, RTCCollision* collisions, unsigned count) {
  std::size_t pairs = 0;
  for (unsigned i = 0; i < count; ++i) pairs += collisions[i].primID0 < collisions[i].primID1;
  static_cast<std::atomic<std::size_t>*>(data)->fetch_add(pairs, std::memory_order_relaxed);
}
void countBetween(void* data, RTCCollision*, unsigned count) {
  static_cast<std::atomic<std::size_t>*>(data)->fetch_add(count, std::memory_order_relaxed);
}

class EmbreeScene {
 public:
  EmbreeScene(RTCDevice device, const MeshBoxes& boxes, RTCBuildQuality quality)
      : scene_(rtcNewScene(device)), geometry_(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER)) {
    for (const MeshBox& box : boxes) {
      RTCBounds bounds = {};
      for (int axis = 0; axis < 3; ++axis) {
        (&bounds.lower_x)[axis] = floatBelow(box.lower[axis]);
        (&bounds.upper_x)[axis] = floatAbove(box.upper[axis]);
      }
      bounds_.push_back(bounds);
    }
    rtcSetSceneBuildQuality(scene_, quality);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
    rtcSetGeometryBuildQuality(geometry_, quality);
    rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(bounds_.size()));
    rtcSetGeometryUserData(geometry_, bounds_.data());
    rtcSetGeometryBoundsFunction(geometry_, boundsOf, nullptr);
    rtcCommitGeometry(geometry_);
    rtcAttachGeometry(scene_, geometry_);
    rtcCommitScene(scene_);
  }
  ~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseGeometry(geometry_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  RTCScene rebuild() {
    rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
    return scene_;
  }

 private:
  RTCScene scene_;
  RTCGeometry geometry_;
  std::vector<RTCBounds> bounds_;
};

class EmbreeFinder : public MeshFinder {
 public:
  EmbreeFinder(const MeshBoxes& a, const MeshBoxes* b, int threads, RTCBuildQuality quality)
      : device_(rtcNewDevice(("threads=" + std::to_string(threads)).c_str())) {
    if (!device_) throw std::runtime_error("Embree: no device");
    first_ = std::make_unique<EmbreeScene>(device_, a, quality);
    if (b) second_ = std::make_unique<EmbreeScene>(device_, *b, quality);
  }
  ~EmbreeFinder() override {
    first_.reset();
    second_.reset();
    rtcReleaseDevice(device_);
  }
  std::size_t find() override {
    const Stopwatch clock;
    std::atomic<std::size_t> pairs{0};
    const RTCScene first = first_->rebuild();
    if (second_)
      rtcCollide(first, second_->rebuild(), countBetween, &pairs);
    else
      rtcCollide(first, first, countWithin, &pairs);
    extraction_ = clock.milliseconds();
    return pairs;
  }
  double extraction() const override { return extraction_; }

 private:
  RTCDevice device_;
  std::unique_ptr<EmbreeScene> first_, second_;
  double extraction_ = 0;
};

template <RTCBuildQuality quality>
std::unique_ptr<MeshFinder> createEmbree(const MeshBoxes& a, const MeshBoxes* b, int threads) {
  return std::make_unique<EmbreeFinder>(a, b, threads, quality);
}

}  // namespace

void addEmbreeFinders(std::vector<MeshFinderKind>& kinds) {
  const std::string library = "Embree " RTC_VERSION_STRING;
  kinds.push_back({"embree", library, false, createEmbree<RTC_BUILD_QUALITY_LOW>});
  kinds.push_back({"embree-default", library, false, createEmbree<RTC_BUILD_QUALITY_MEDIUM>});
}

}  // namespace bench
