#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <numeric>

#include "bench_scenes.h"
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

// The boxes of the geoms that are shown, by number.
using Shown = std::map<std::uint32_t, CentredBox>;

std::vector<Shown> shownIn(const trace::Recording& recording, bool bodies_only) {
  std::map<std::uint32_t, trace::Geom> geoms;
  std::vector<Shown> all;
  for (const trace::Frame& frame : recording.frames) {
    for (const std::uint32_t number : frame.removed) geoms.erase(number);
    for (const trace::Geom& geom : frame.geoms) geoms[geom.number] = geom;
    for (const auto* list : {&frame.poses, &frame.bounds})
      for (const trace::Geom& geom : *list) geoms[geom.number].bounds = geom.bounds;
    all.emplace_back();
    for (const auto& [number, geom] : geoms)
      if (isShown(geom) && (!bodies_only || geom.body)) all.back()[number] = boxOf(geom.bounds);
  }
  return all;
}

// Each geom has a place for as long as it is shown. A free one is the next geom's, and aside.
Frames framesOf(const std::string& path, bool bodies_only) {
  const std::vector<Shown> all = shownIn(trace::readRecording(path), bodies_only);
  using Holders = std::vector<std::uint32_t>;  // of the places; 0: free
  std::vector<Holders> holders;
  Holders now;
  double end = 0;
  for (const Shown& shown : all) {
    for (std::uint32_t& number : now) number = shown.count(number) ? number : 0;
    for (const auto& [number, box] : shown) {
      end = std::max<double>(end, box.high(0));
      if (std::find(now.begin(), now.end(), number) != now.end()) continue;
      if (std::find(now.begin(), now.end(), 0) == now.end()) now.push_back(0);
      *std::find(now.begin(), now.end(), 0) = number;
    }
    holders.push_back(now);
  }
  Boxes aside(now.size());
  const double unit = std::max(1.0, end / 1024);
  const dReal half = static_cast<dReal>(unit / 2);
  for (std::size_t i = 0; i < aside.size(); ++i)
    aside[i] = {{static_cast<dReal>(end + unit * 2 * static_cast<double>(1 + i)), 0, 0},
                {half, half, half}};
  Frames frames(all.size(), aside);
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t k = 0; k < holders[i].size(); ++k)
      if (holders[i][k]) frames[i][k] = all[i].at(holders[i][k]);
  return frames;
}

// Where a box of the scene comes from.
struct Place {
  std::size_t recorded;
  dReal x = 0, y = 0;  // of the copy
};

// Frames there and back.
MovingScene recorded(const std::shared_ptr<const Frames>& frames,
                     const std::vector<Place>& places) {
  MovingScene scene = {Boxes(places.size()), [=, frame = std::size_t{0}](Boxes& boxes) mutable {
                         const std::size_t last = frames->size() - 1, phase = frame++;
                         const Boxes& from = (*frames)[phase <= last ? phase : 2 * last - phase];
                         if (frame >= 2 * last) frame = 0;
                         for (std::size_t i = 0; i < boxes.size(); ++i) {
                           boxes[i] = from[places[i].recorded];
                           boxes[i].centre[0] += places[i].x;
                           boxes[i].centre[1] += places[i].y;
                         }
                       }};
  scene.next();
  return scene;
}

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
  sap_test::shuffle(places.data(), n, random);
  return places;
}

}  // namespace

SceneKind traceScene(const std::string& path) {
  const auto frames = std::make_shared<const Frames>(framesOf(path, false));
  std::vector<Place> places;
  for (std::size_t i = 0; i < frames->front().size(); ++i) places.push_back({i});
  return {"trace", "the bounding boxes of " + path,
          [=](std::size_t, std::uint64_t) { return recorded(frames, places); }, places.size(),
          places.size()};
}

std::vector<SceneKind> pileScenes(const std::string& directory) {
  std::vector<SceneKind> kinds;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    if (entry.path().extension() != ".trace") continue;
    // Read when first used, and kept.
    kinds.push_back({"pile-" + entry.path().stem().string(),
                     "recorded from examples/pile, copies side by side",
                     [path = entry.path().string(), kept = std::make_shared<Frames>()](
                         std::size_t n, std::uint64_t seed) {
                       if (kept->empty()) *kept = framesOf(path, true);
                       return recorded(kept, placesInCopies(kept->front(), n, seed));
                     }});
  }
  std::sort(kinds.begin(), kinds.end(),
            [](const SceneKind& a, const SceneKind& b) { return a.name < b.name; });
  return kinds;
}

}  // namespace bench
