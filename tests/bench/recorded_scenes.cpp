#include "recorded_scenes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "player.h"
#include "random.h"

namespace bench {
namespace {

using Frames = std::vector<Boxes>;

bool isShown(const trace::Geom& geom) {
  if (geom.parent != 0 || !geom.is(trace::format::enabled) || geom.is(trace::format::zero_sized))
    return false;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(geom.bounds[2 * axis] <= geom.bounds[2 * axis + 1]) ||
        !std::isfinite(geom.bounds[2 * axis + 1] - geom.bounds[2 * axis]))
      return false;
  return true;
}

CentredBox boxOf(const trace::Bounds& bounds) {
  CentredBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = bounds[2 * axis], high = bounds[2 * axis + 1];
    box.centre[axis] = static_cast<dReal>(low / 2 + high / 2);
    box.half[axis] = static_cast<dReal>((high - low) / 2);
  }
  return box;
}

// Gives each geom a box for as long as it is shown. A box that no geom has is the next one's.
class BoxesOfGeoms {
 public:
  void show(const trace::Frame& frame, bool bodies_only) {
    for (const std::uint32_t number : frame.removed) geoms_.erase(number);
    for (const trace::Geom& geom : frame.geoms) geoms_[geom.number] = geom;
    for (const auto* list : {&frame.poses, &frame.bounds})
      for (const trace::Geom& geom : *list) geoms_[geom.number].bounds = geom.bounds;
    std::map<std::uint32_t, std::size_t> places;
    std::set<std::size_t> free = unused_;
    for (const auto& [number, place] : places_)
      if (isWanted(number, bodies_only))
        places[number] = place;
      else
        free.insert(place);
    for (const auto& [number, geom] : geoms_) {
      if (!isWanted(number, bodies_only)) continue;
      if (!places.count(number)) {
        if (free.empty()) free.insert(places.size());
        places[number] = *free.begin();
        free.erase(free.begin());
      }
      greatest_x_ = std::max(greatest_x_, geom.bounds[1]);
    }
    places_ = std::move(places);
    unused_ = std::move(free);
  }

  // The number of boxes so far, those without a geom included.
  std::size_t size() const { return places_.size() + unused_.size(); }
  double greatestX() const { return greatest_x_; }
  template <class Put>
  void forEach(Put put) const {
    for (const auto& [number, place] : places_) put(place, boxOf(geoms_.at(number).bounds));
  }

 private:
  bool isWanted(std::uint32_t number, bool bodies_only) const {
    const auto geom = geoms_.find(number);
    return geom != geoms_.end() && isShown(geom->second) && (!bodies_only || geom->second.body);
  }

  std::map<std::uint32_t, trace::Geom> geoms_;
  std::map<std::uint32_t, std::size_t> places_;
  std::set<std::size_t> unused_;
  double greatest_x_ = 0;
};

Frames framesOf(const std::string& path, bool bodies_only) {
  const trace::Recording recording = trace::readRecording(path);
  BoxesOfGeoms all;
  for (const trace::Frame& frame : recording.frames) all.show(frame, bodies_only);
  Boxes aside(all.size());
  const double unit = std::max(1.0, all.greatestX() / 1024);
  for (std::size_t i = 0; i < aside.size(); ++i) {
    const double x = all.greatestX() + unit * 2 * static_cast<double>(1 + i);
    const dReal half = static_cast<dReal>(unit / 2);
    aside[i] = {{static_cast<dReal>(x), 0, 0}, {half, half, half}};
  }
  Frames frames;
  BoxesOfGeoms shown;
  for (const trace::Frame& frame : recording.frames) {
    shown.show(frame, bodies_only);
    frames.push_back(aside);
    shown.forEach([&](std::size_t place, const CentredBox& box) { frames.back()[place] = box; });
  }
  return frames;
}

// Where a box of the scene comes from.
struct Place {
  std::size_t recorded;
  dReal x = 0, y = 0;  // of the copy
};

// Frames there and back.
class RecordedScene : public MovingScene {
 public:
  RecordedScene(std::shared_ptr<const Frames> frames, std::vector<Place> places)
      : frames_(std::move(frames)), places_(std::move(places)) {
    boxes_.resize(places_.size());
    show(0);
  }

  void advance() override {
    const std::size_t last = frames_->size() - 1;
    if (last == 0) return;
    const std::size_t phase = ++frame_ % (2 * last);
    show(phase <= last ? phase : 2 * last - phase);
  }

 private:
  void show(std::size_t frame) {
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      boxes_[i] = (*frames_)[frame][places_[i].recorded];
      boxes_[i].centre[0] += places_[i].x;
      boxes_[i].centre[1] += places_[i].y;
    }
  }

  const std::shared_ptr<const Frames> frames_;
  const std::vector<Place> places_;
  std::size_t frame_ = 0;
};

// In an order that says nothing about where they are.
std::vector<Place> placesInCopies(const Boxes& boxes, std::size_t n, std::uint64_t seed) {
  const Extent extent = extentOf(boxes);
  const auto distance = [&](std::size_t i) {
    return std::hypot(boxes[i].centre[0] - (extent.low[0] + extent.high[0]) / 2,
                      boxes[i].centre[1] - (extent.low[1] + extent.high[1]) / 2);
  };
  std::vector<std::size_t> from_middle(boxes.size());
  std::iota(from_middle.begin(), from_middle.end(), std::size_t{0});
  std::sort(from_middle.begin(), from_middle.end(),
            [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
  const std::size_t copies = (n + boxes.size() - 1) / boxes.size();
  const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(copies))));
  const double width = extent.high[0] - extent.low[0] + 1,
               depth = extent.high[1] - extent.low[1] + 1;
  std::vector<Place> places;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t copy = i / boxes.size();
    places.push_back({from_middle[i % boxes.size()],
                      static_cast<dReal>(width * static_cast<double>(copy % columns)),
                      static_cast<dReal>(depth * static_cast<double>(copy / columns))});
  }
  sap_test::Random random(seed);
  for (std::size_t i = n; i > 1; --i) std::swap(places[i - 1], places[random.below(i)]);
  return places;
}

}  // namespace

SceneKind traceScene(const std::string& path) {
  const auto frames = std::make_shared<const Frames>(framesOf(path, false));
  std::vector<Place> places;
  for (std::size_t i = 0; i < frames->front().size(); ++i) places.push_back({i});
  SceneKind kind;
  kind.name = "trace";
  kind.about = "the bounding boxes of " + path;
  kind.most = kind.always = places.size();
  kind.make = [=](std::size_t, std::uint64_t) {
    return std::make_unique<RecordedScene>(frames, places);
  };
  return kind;
}

std::vector<SceneKind> pileScenes(const std::string& directory) {
  std::vector<SceneKind> kinds;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    if (entry.path().extension() != ".trace") continue;
    SceneKind kind;
    kind.name = "pile-" + entry.path().stem().string();
    kind.about = "recorded from examples/pile, copies side by side";
    // Read when first used, and kept.
    kind.make = [path = entry.path().string(), kept = std::make_shared<Frames>()](
                    std::size_t n, std::uint64_t seed) {
      if (kept->empty()) *kept = framesOf(path, true);
      return std::make_unique<RecordedScene>(kept, placesInCopies(kept->front(), n, seed));
    };
    kinds.push_back(kind);
  }
  std::sort(kinds.begin(), kinds.end(),
            [](const SceneKind& a, const SceneKind& b) { return a.name < b.name; });
  return kinds;
}

}  // namespace bench
