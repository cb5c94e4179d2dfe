// Boxes of meshes in scenes of Embree, a group each.
#include <atomic>
#include <optional>

#include "mesh_finder.h"
#include "peers/embree_scene.h"
#include "stopwatch.h"

namespace bench {
namespace {

// A function for rtcCollide of two scenes.
void countBetween(void* data, RTCCollision*, unsigned count) {
  static_cast<std::atomic<std::size_t>*>(data)->fetch_add(count, std::memory_order_relaxed);
}

class EmbreeFinder : public MeshFinder {
 public:
  EmbreeFinder(const MeshBoxes& a, const MeshBoxes* b, int threads, RTCBuildQuality quality)
      : device_(newEmbreeDevice(threads)) {
    build(first_, a, quality);
    if (b) build(second_, *b, quality);
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
      rtcCollide(first, first, EmbreeScene::countWithin, &pairs);
    extraction_ = clock.milliseconds();
    return pairs;
  }
  double extraction() const override { return extraction_; }

 private:
  void build(std::optional<EmbreeScene>& scene, const MeshBoxes& boxes, RTCBuildQuality quality) {
    scene.emplace();
    scene->resize(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        scene->set(i, axis, boxes[i].lower[axis], boxes[i].upper[axis]);
    scene->build(device_, quality);
  }

  RTCDevice device_;
  std::optional<EmbreeScene> first_, second_;
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
