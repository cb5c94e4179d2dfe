#include "trace_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "player.h"

namespace bench {
namespace {

bool isShown(const trace::Geom& geom) {
  if (geom.parent != 0 || !geom.is(trace::format::enabled) || geom.is(trace::format::zero_sized))
    return false;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(geom.bounds[2 * axis] <= geom.bounds[2 * axis + 1]) ||
        !std::isfinite(geom.bounds[2 * axis + 1] - geom.bounds[2 * axis]))
      return false;
  return true;
}

// The geoms of one frame after the other, by number.
class Frames {
 public:
  explicit Frames(const trace::Recording& recording) : recording_(recording) { show(); }
  void next() {
    if (++place_ == recording_.frames.size()) {
      place_ = 0;
      geoms_.clear();
    }
    show();
  }
  const std::map<std::uint32_t, trace::Geom>& geoms() const { return geoms_; }

 private:
  void show() {
    const trace::Frame& frame = recording_.frames[place_];
    for (const std::uint32_t number : frame.removed) geoms_.erase(number);
    for (const trace::Geom& geom : frame.geoms) geoms_[geom.number] = geom;
    for (const auto* list : {&frame.poses, &frame.bounds})
      for (const trace::Geom& geom : *list) geoms_[geom.number].bounds = geom.bounds;
  }

  const trace::Recording& recording_;
  std::size_t place_ = 0;
  std::map<std::uint32_t, trace::Geom> geoms_;
};

// What a scene needs to know before its first frame.
struct Extremes {
  std::size_t boxes = 0;  // the most that are shown at once
  double greatest_x = 0;
};

Extremes extremesOf(const trace::Recording& recording) {
  Extremes extremes;
  Frames frames(recording);
  for (std::size_t i = 0; i < recording.frames.size(); ++i, frames.next()) {
    std::size_t boxes = 0;
    for (const auto& geom : frames.geoms()) {
      if (!isShown(geom.second)) continue;
      ++boxes;
      extremes.greatest_x = std::max(extremes.greatest_x, geom.second.bounds[1]);
    }
    extremes.boxes = std::max(extremes.boxes, boxes);
  }
  return extremes;
}

class TraceScene : public MovingScene {
 public:
  TraceScene(const trace::Recording& recording, const Extremes& extremes)
      : frames_(recording), extremes_(extremes) {
    boxes_.resize(extremes.boxes);
    owners_.resize(extremes.boxes);
    show();
  }
  void advance() override {
    frames_.next();
    show();
  }

 private:
  // A geom keeps its box for as long as it is shown.
  void show() {
    std::vector<std::size_t> free;
    for (std::size_t i = 0; i < owners_.size(); ++i) {
      const auto geom = frames_.geoms().find(owners_[i]);
      if (geom != frames_.geoms().end() && isShown(geom->second)) continue;
      places_.erase(owners_[i]);
      owners_[i] = 0;
      free.push_back(i);
    }
    for (const auto& [number, geom] : frames_.geoms()) {
      if (!isShown(geom)) continue;
      const auto known = places_.find(number);
      std::size_t place = 0;
      if (known != places_.end()) {
        place = known->second;
      } else {
        place = free.back();
        free.pop_back();
        owners_[place] = number;
        places_[number] = place;
      }
      put(geom, boxes_[place]);
    }
    for (const std::size_t place : free) boxes_[place] = aside(place);
  }

  static void put(const trace::Geom& geom, CentredBox& box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = geom.bounds[2 * axis], high = geom.bounds[2 * axis + 1];
      box.centre[axis] = static_cast<dReal>(low / 2 + high / 2);
      box.half[axis] = static_cast<dReal>((high - low) / 2);
    }
  }
  CentredBox aside(std::size_t place) const {
    const double unit = std::max(1.0, extremes_.greatest_x / 1024);
    const double x = extremes_.greatest_x + unit * 2 * static_cast<double>(1 + place);
    const dReal half = static_cast<dReal>(unit / 2);
    return {{static_cast<dReal>(x), 0, 0}, {half, half, half}};
  }

  Frames frames_;
  const Extremes extremes_;
  std::vector<std::uint32_t> owners_;  // of each box, 0: none
  std::map<std::uint32_t, std::size_t> places_;
};

}  // namespace

SceneKind traceScene(const std::string& path) {
  const auto recording = std::make_shared<const trace::Recording>(trace::readRecording(path));
  const Extremes extremes = extremesOf(*recording);
  SceneKind kind;
  kind.name = "trace";
  kind.about = "the bounding boxes of " + path;
  kind.most = kind.always = extremes.boxes;
  kind.make = [recording, extremes](std::size_t, std::uint64_t) {
    return std::make_unique<TraceScene>(*recording, extremes);
  };
  return kind;
}

}  // namespace bench
