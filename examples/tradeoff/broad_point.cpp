#include "broad_point.h"

#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <unordered_set>
#include <vector>

#include "../pile/random.h"

namespace tradeoff {
namespace {

constexpr int frames_to_warm_up = 3;
constexpr double boxes_per_cubic_metre = 1.17;  // about four pairs a box

struct Box {
  std::array<double, 3> low;
  std::array<double, 3> high;
};

using PairSet = std::unordered_set<std::uint64_t>;

std::uint64_t keyOf(size_t a, size_t b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
}

bool overlap(const Box& a, const Box& b) {
  for (size_t i = 0; i < 3; ++i)
    if (a.low[i] > b.high[i] || b.low[i] > a.high[i]) return false;
  return true;
}

// Those that overlap, closed intervals, found along the x axis.
PairSet pairsOf(const std::vector<Box>& boxes) {
  std::vector<size_t> order(boxes.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return boxes[a].low[0] < boxes[b].low[0]; });
  PairSet pairs;
  for (size_t i = 0; i < order.size(); ++i)
    for (size_t j = i + 1; j < order.size(); ++j) {
      if (boxes[order[j]].low[0] > boxes[order[i]].high[0]) break;
      if (overlap(boxes[order[i]], boxes[order[j]])) pairs.insert(keyOf(order[i], order[j]));
    }
  return pairs;
}

// The boxes as they are meant: double precision, near the origin.
class Scene {
 public:
  explicit Scene(const BroadSettings& settings)
      : settings_(settings), random_(settings.seed), frame_(0) {
    const double side = std::cbrt(settings.boxes / boxes_per_cubic_metre);
    for (int i = 0; i < settings.boxes; ++i) {
      Item item;
      for (size_t k = 0; k < 3; ++k) {
        item.place[k] = random_.uniform(0, side);
        item.extent[k] = random_.uniform(0.5, 1.5);
        item.step[k] = random_.uniform(-settings.step, settings.step);
      }
      items_.push_back(item);
    }
  }

  // Back and forth, ten frames each way, so that the scene stays as dense as it is.
  void move() {
    const double direction = frame_++ / 10 % 2 ? -1 : 1;
    for (Item& item : items_)
      for (size_t k = 0; k < 3; ++k) item.place[k] += direction * item.step[k];
  }

  size_t size() const { return items_.size(); }
  const std::array<double, 3>& extent(size_t i) const { return items_[i].extent; }

  void put(size_t i, dGeomID geom) const {
    const auto& place = items_[i].place;
    dGeomSetPosition(geom, static_cast<dReal>(settings_.offset + place[0]),
                     static_cast<dReal>(settings_.offset + place[1]),
                     static_cast<dReal>(settings_.offset + place[2]));
  }

  std::vector<Box> boxes() const {
    std::vector<Box> boxes(size());
    for (size_t i = 0; i < size(); ++i)
      for (size_t k = 0; k < 3; ++k) {
        boxes[i].low[k] = items_[i].place[k] - items_[i].extent[k] / 2;
        boxes[i].high[k] = items_[i].place[k] + items_[i].extent[k] / 2;
      }
    return boxes;
  }

 private:
  struct Item {
    std::array<double, 3> place, extent, step;
  };

  const BroadSettings settings_;
  pile::Random random_;
  int frame_;
  std::vector<Item> items_;
};

dSpaceID createSpace(const BroadSettings& settings) {
  if (settings.space == "hash") return dHashSpaceCreate(nullptr);
  if (settings.space == "sap") return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  dParallelSAPSpaceSetNumThreads(space, settings.threads);
  dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(settings.tolerance));
  const int backend = settings.backend == "cuda" ? dParallelSAPBackendCUDA : dParallelSAPBackendCPU;
  if (!dParallelSAPSpaceSetBackend(space, backend))
    throw std::runtime_error("the back end " + settings.backend + " is not to be had here");
  return space;
}

std::vector<Box> storedBoxes(const std::vector<dGeomID>& geoms) {
  std::vector<Box> boxes;
  for (dGeomID geom : geoms) {
    dReal aabb[6];
    dGeomGetAABB(geom, aabb);
    boxes.push_back({{aabb[0], aabb[2], aabb[4]}, {aabb[1], aabb[3], aabb[5]}});
  }
  return boxes;
}

void countPair(void* data, dGeomID, dGeomID) {
  ++*static_cast<std::uint64_t*>(data);
}

// Counts the reported pairs and those of them that are in each of the references.
struct Comparison {
  const PairSet& meant;
  const PairSet& stored;
  std::uint64_t reported = 0;
  std::uint64_t of_meant = 0;
  std::uint64_t of_stored = 0;

  static void add(void* data, dGeomID first, dGeomID second) {
    Comparison& self = *static_cast<Comparison*>(data);
    const auto number = [](dGeomID geom) {
      return reinterpret_cast<std::uintptr_t>(dGeomGetData(geom));
    };
    const std::uint64_t key = keyOf(number(first), number(second));
    ++self.reported;
    self.of_meant += self.meant.count(key);
    self.of_stored += self.stored.count(key);
  }
};

void compare(dSpaceID space, const Scene& scene, const std::vector<dGeomID>& geoms, Row& row) {
  const PairSet meant = pairsOf(scene.boxes());
  const PairSet stored = pairsOf(storedBoxes(geoms));
  Comparison comparison = {meant, stored};
  dSpaceCollide(space, &comparison, Comparison::add);
  row.add("pairs", comparison.reported);
  row.add("exact_pairs", meant.size());
  row.add("extra_per_exact", static_cast<double>(comparison.reported - comparison.of_meant) /
                                 static_cast<double>(meant.size()));
  row.add("missed", meant.size() - comparison.of_meant);
  row.add("extra_of_stored", comparison.reported - comparison.of_stored);
  row.add("missed_of_stored", stored.size() - comparison.of_stored);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

}  // namespace

Row measureBroadPhase(const BroadSettings& settings) {
  Scene scene(settings);
  const dSpaceID space = createSpace(settings);
  std::vector<dGeomID> geoms;
  for (size_t i = 0; i < scene.size(); ++i) {
    const auto& extent = scene.extent(i);
    geoms.push_back(dCreateBox(space, static_cast<dReal>(extent[0]), static_cast<dReal>(extent[1]),
                               static_cast<dReal>(extent[2])));
    dGeomSetData(geoms.back(), reinterpret_cast<void*>(static_cast<std::uintptr_t>(i)));
  }

  std::vector<double> times;
  for (int frame = 0; frame < frames_to_warm_up + settings.frames; ++frame) {
    scene.move();
    for (size_t i = 0; i < scene.size(); ++i) scene.put(i, geoms[i]);
    std::uint64_t pairs = 0;
    const auto start = std::chrono::steady_clock::now();
    dSpaceCollide(space, &pairs, countPair);
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - start;
    if (frame >= frames_to_warm_up) times.push_back(passed.count());
  }
  Row row;
  row.add("ms", median(times));
  row.add("least_ms", *std::min_element(times.begin(), times.end()));
  compare(space, scene, geoms, row);
  dSpaceDestroy(space);
  return row;
}

}  // namespace tradeoff
