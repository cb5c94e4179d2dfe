#include "bench_scenes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mesh_data.h"
#include "pile_recording.h"
#include "random.h"
#include "scenes.h"
#include "swing.h"

namespace bench {

using sap_test::Random;

std::vector<bool> differing(const Boxes& before, const Boxes& after) {
  std::vector<bool> differ;
  for (std::size_t i = 0; i < after.size(); ++i) differ.push_back(!(before[i] == after[i]));
  return differ;
}

Extent extentOf(const Boxes& boxes) {
  Extent extent;
  for (int axis = 0; axis < 3; ++axis) {
    extent.low[axis] = std::numeric_limits<double>::infinity();
    extent.high[axis] = -extent.low[axis];
    for (const CentredBox& box : boxes) {
      extent.low[axis] = std::min<double>(extent.low[axis], box.low(axis));
      extent.high[axis] = std::max<double>(extent.high[axis], box.high(axis));
    }
  }
  return extent;
}

namespace {

constexpr std::size_t any_number = std::numeric_limits<std::size_t>::max();

CentredBox centred(const sap_test::Box& box) {
  CentredBox centred;
  for (int axis = 0; axis < 3; ++axis) {
    centred.centre[axis] = static_cast<dReal>((box.low[axis] + box.high[axis]) / 2);
    centred.half[axis] = static_cast<dReal>((box.high[axis] - box.low[axis]) / 2);
  }
  return centred;
}

Boxes centred(const sap_test::Boxes& boxes) {
  Boxes all;
  all.reserve(boxes.size());
  for (const sap_test::Box& box : boxes) all.push_back(centred(box));
  return all;
}

CentredBox cube(double x, double y, double z, double half) {
  const dReal h = static_cast<dReal>(half);
  return {{static_cast<dReal>(x), static_cast<dReal>(y), static_cast<dReal>(z)}, {h, h, h}};
}

// Every box goes back and forth around its place, in each frame by up to a tenth of its width along
// each axis, or another part, so that the distribution stays what it is.
class SwingingScene : public MovingScene {
 public:
  SwingingScene(Boxes places, std::uint64_t seed, double part = 0.1) : places_(std::move(places)) {
    Random random(seed ^ 0x5377696e67u);
    velocities_.resize(places_.size());
    for (std::size_t i = 0; i < places_.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        velocities_[i][axis] =
            static_cast<float>(places_[i].half[axis] * random.between(-2 * part, 2 * part));
    boxes_ = places_;
  }

  void advance() override {
    const int way = swing(++frame_);
    for (std::size_t i = 0; i < places_.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        boxes_[i].centre[axis] =
            places_[i].centre[axis] + static_cast<dReal>(velocities_[i][axis]) * way;
  }

 private:
  struct Velocity {
    float axis[3];
    float& operator[](int i) { return axis[i]; }
  };
  const Boxes places_;
  std::vector<Velocity> velocities_;
  int frame_ = 0;
};

// All boxes move together, by a distance that rounds nothing: what touches goes on touching.
class ShiftingScene : public MovingScene {
 public:
  explicit ShiftingScene(Boxes places) : places_(std::move(places)) { boxes_ = places_; }

  void advance() override {
    const dReal way = static_cast<dReal>(swing(++frame_)) / 16;
    for (std::size_t i = 0; i < places_.size(); ++i)
      for (dReal *to = boxes_[i].centre, *at = const_cast<dReal*>(places_[i].centre), *end = at + 3;
           at != end; ++at, ++to)
        *to = *at + way;
  }

 private:
  const Boxes places_;
  int frame_ = 0;
};

// Unit cubes that are somewhere else in every frame: in a dense cube or, if `crowds`, by turns in a
// crowd of which every twentieth couple overlaps, for eight frames each.
class JumpingScene : public MovingScene {
 public:
  JumpingScene(std::size_t n, std::uint64_t seed, bool crowds) : crowds_(crowds), random_(seed) {
    boxes_.resize(n);
    jump();
  }
  void advance() override {
    ++frame_;
    jump();
  }

 private:
  void jump() {
    constexpr double crowd_side = 5;
    const double cube_side = 0.95 * std::cbrt(static_cast<double>(boxes_.size()));
    const bool crowd = crowds_ && frame_ % 16 < 8;
    const double side = crowd ? std::min(crowd_side, cube_side) : cube_side;
    for (CentredBox& box : boxes_) {
      const double x = random_.between(0, side), y = random_.between(0, side);
      box = cube(x, y, random_.between(0, side), 0.5);
    }
  }

  const bool crowds_;
  Random random_;
  int frame_ = 0;
};

// The scenes of Broadmark (Serpa and Rodrigues: Broadmark, a testing framework for broad-phase
// collision detection algorithms, 2020): free bodies in a cube that they fill to a tenth, started
// inside a ball, thrown back by the walls. They do not hinder one another.
class BroadmarkScene : public MovingScene {
 public:
  enum Motion { Brownian, Gravity };

  BroadmarkScene(std::size_t n, std::uint64_t seed, Motion motion, bool assorted)
      : motion_(motion), random_(seed) {
    side_ = std::cbrt(static_cast<double>(n) / 0.1);
    velocities_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      boxes_.push_back(inBall());
      if (assorted) resize(boxes_.back());
      for (double& v : velocities_[i].axis) v = anySpeed();
    }
  }

  void advance() override {
    ++frame_;
    if (motion_ == Brownian) disturb();
    const double turn = 0.02 * frame_;
    const double g = motion_ == Brownian ? 0 : 4 * 9.81;
    const double pull[3] = {g * std::sin(turn), g * std::sin(turn / 3) * std::cos(turn),
                            -g * std::cos(turn / 3) * std::cos(turn)};
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      for (int axis = 0; axis < 3; ++axis) step(i, axis, pull[axis]);
  }

 private:
  static constexpr double dt = 1.0 / 60;

  struct Velocity {
    double axis[3];
  };

  CentredBox inBall() {
    for (;;) {
      double p[3], r = 0;
      for (double& x : p) {
        x = random_.between(-0.45, 0.45);
        r += x * x;
      }
      if (r <= 0.45 * 0.45) return cube(p[0] * side_, p[1] * side_, p[2] * side_, 0.5);
    }
  }

  // Widths from 0.5 to 2, every tenth a bar of eight times its width.
  void resize(CentredBox& box) {
    for (dReal& half : box.half) half = static_cast<dReal>(random_.between(0.25, 1));
    if (random_.chance(0.1)) box.half[random_.below(3)] *= 8;
  }

  double anySpeed() { return random_.between(-0.75, 0.75) * side_ / std::sqrt(3.0); }

  void disturb() {
    for (std::size_t i = 0; i < boxes_.size() / 100; ++i)
      for (double& v : velocities_[random_.below(boxes_.size())].axis) v = anySpeed();
  }

  void step(std::size_t i, int axis, double pull) {
    double& v = velocities_[i].axis[axis];
    v += pull * dt;
    double x = static_cast<double>(boxes_[i].centre[axis]) + v * dt;
    const double wall = side_ / 2;
    if (x > wall || x < -wall) {
      x = std::clamp(2 * std::copysign(wall, x) - x, -wall, wall);
      v = -v;
    }
    boxes_[i].centre[axis] = static_cast<dReal>(x);
  }

  const Motion motion_;
  Random random_;
  double side_;
  std::vector<Velocity> velocities_;
  int frame_ = 0;
};

// Frames of a recorded pile there and back: the bodies in its middle if n is smaller, copies side
// by side if n is larger, in an order that says nothing about where they are.
class PileScene : public MovingScene {
 public:
  PileScene(std::shared_ptr<const BoxRecording> recording, std::size_t n, std::uint64_t seed)
      : recording_(std::move(recording)) {
    const Extent extent = extentOf(recording_->frames.front());
    const std::vector<std::size_t> from_middle = bodiesFromMiddle(extent);
    const std::size_t bodies = from_middle.size();
    const double copies = std::ceil(static_cast<double>(n) / static_cast<double>(bodies));
    const std::size_t columns = static_cast<std::size_t>(std::ceil(std::sqrt(copies)));
    const double width = extent.high[0] - extent.low[0] + 1,
                 depth = extent.high[1] - extent.low[1] + 1;
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t copy = i / bodies;
      places_.push_back({from_middle[i % bodies],
                         static_cast<dReal>(width * static_cast<double>(copy % columns)),
                         static_cast<dReal>(depth * static_cast<double>(copy / columns))});
    }
    Random random(seed);
    for (std::size_t i = n; i > 1; --i) std::swap(places_[i - 1], places_[random.below(i)]);
    boxes_.resize(n);
    show(0);
  }

  void advance() override {
    const int last = static_cast<int>(recording_->frames.size()) - 1;
    const int phase = ++frame_ % (2 * last);
    show(static_cast<std::size_t>(phase <= last ? phase : 2 * last - phase));
  }

 private:
  struct Place {
    std::size_t body;
    dReal x, y;  // of the copy
  };

  std::vector<std::size_t> bodiesFromMiddle(const Extent& extent) const {
    const Boxes& boxes = recording_->frames.front();
    const auto distance = [&](std::size_t body) {
      const double x = boxes[body].centre[0] - (extent.low[0] + extent.high[0]) / 2,
                   y = boxes[body].centre[1] - (extent.low[1] + extent.high[1]) / 2;
      return x * x + y * y;
    };
    std::vector<std::size_t> bodies(boxes.size());
    std::iota(bodies.begin(), bodies.end(), std::size_t{0});
    std::sort(bodies.begin(), bodies.end(),
              [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
    return bodies;
  }

  void show(std::size_t frame) {
    const Boxes& shown = recording_->frames[frame];
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      boxes_[i] = shown[places_[i].body];
      boxes_[i].centre[0] += places_[i].x;
      boxes_[i].centre[1] += places_[i].y;
    }
  }

  const std::shared_ptr<const BoxRecording> recording_;
  std::vector<Place> places_;
  int frame_ = 0;
};

// Bars of 1 x 1 x 20 along each of the axes, about 4.5 pairs each whatever n is.
Boxes thinBars(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const double side = 4.1 * std::cbrt(static_cast<double>(n));
  Boxes boxes;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = random.between(0, side), y = random.between(0, side);
    boxes.push_back(cube(x, y, random.between(0, side), 0.5));
    boxes.back().half[random.below(3)] = 10;
  }
  return boxes;
}

// Log-uniform sizes from 1 down to 10^-decades, about 4.5 pairs each.
Boxes logSizes(std::size_t n, double decades, std::uint64_t seed) {
  Random random(seed);
  // n boxes of sizes s in a volume V make n^2 / 2 E[(s + t)^3] / V pairs; E[(s + t)^3] is
  // 2 E[s^3] + 6 E[s^2] E[s], for log-uniform s about (2 / 3 + 3 / L) / L with L = ln 10^decades.
  const double l = decades * std::log(10.0);
  const double side = std::cbrt(static_cast<double>(n) * (2.0 / 3 + 3 / l) / l / 9);
  Boxes boxes;
  for (std::size_t i = 0; i < n; ++i) {
    const double size = std::pow(10, -decades * random.unit());
    const double x = random.between(0, side), y = random.between(0, side);
    boxes.push_back(cube(x, y, random.between(0, side), size / 2));
  }
  return boxes;
}

// Unit cubes, of which every tenth is a bar of 1 x 1 x 40.
Boxes barsAmongCubes(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const double side = std::cbrt(static_cast<double>(n) * 6);
  Boxes boxes;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = random.between(0, side), y = random.between(0, side);
    boxes.push_back(cube(x, y, random.between(0, side), 0.5));
    if (i % 10 == 0) boxes.back().half[2 - random.below(3)] = 20;
  }
  return boxes;
}

template <class Make>
SceneKind swinging(const char* name, const char* about, std::size_t most, Make make) {
  return {name, about, most, [make](std::size_t n, std::uint64_t seed) {
            return std::make_unique<SwingingScene>(make(n, seed), seed);
          }};
}

SceneKind jumping(const char* name, const char* about, std::size_t most, bool crowds) {
  return {name, about, most, [=](std::size_t n, std::uint64_t seed) {
            return std::make_unique<JumpingScene>(n, seed, crowds);
          }};
}

SceneKind broadmark(const char* name, const char* about, BroadmarkScene::Motion motion,
                    bool assorted) {
  return {name, about, any_number, [=](std::size_t n, std::uint64_t seed) {
            return std::make_unique<BroadmarkScene>(n, seed, motion, assorted);
          }};
}

SceneKind ofTests(const sap_test::BoxScene& scene) {
  std::string name = scene.name;
  std::replace(name.begin(), name.end(), ' ', '-');
  const auto make = scene.make;
  std::size_t most = any_number;
  if (make == sap_test::onePlace) most = 3000;
  if (make == sap_test::longBars) most = 100000;
  const bool touching = make == sap_test::touchingLattice || make == sap_test::onePlace;
  return {name, "of the tests", most,
          [=](std::size_t n, std::uint64_t seed) -> std::unique_ptr<MovingScene> {
            if (touching) return std::make_unique<ShiftingScene>(centred(make(n, seed)));
            return std::make_unique<SwingingScene>(centred(make(n, seed)), seed);
          }};
}

void addPiles(std::vector<SceneKind>& kinds, const std::string& directory) {
  for (const char* name : {"cubes", "balls", "skittles"}) {
    const std::string path = directory + "/" + name + ".pile";
    if (!pileExists(path)) continue;
    // Read when first used, and kept.
    auto recording = std::make_shared<std::shared_ptr<const BoxRecording>>();
    kinds.push_back({std::string("pile-") + name,
                     "recorded from examples/pile, copies side by side", any_number,
                     [=](std::size_t n, std::uint64_t seed) {
                       if (!*recording) *recording = readPile(path);
                       return std::make_unique<PileScene>(*recording, n, seed);
                     }});
  }
}

Boxes centred(const MeshBoxes& boxes) {
  Boxes all;
  for (const MeshBox& box : boxes) {
    sap_test::Box other;
    std::copy_n(box.lower, 3, other.low);
    std::copy_n(box.upper, 3, other.high);
    all.push_back(centred(other));
  }
  return all;
}

Boxes cloth(std::size_t n, std::uint64_t) {
  // Of side x side vertices: about three edges each.
  const auto side = static_cast<std::size_t>(std::sqrt(static_cast<double>(n) / 3)) + 3;
  Boxes edges = centred(madeCloth(side).edges);
  edges.resize(n);
  return edges;
}

void addMeshes(std::vector<SceneKind>& kinds, const std::string& directory) {
  for (const Mesh& mesh : readMeshes(directory)) {
    const auto boxes = std::make_shared<const Boxes>(centred(mesh.edges));
    kinds.push_back({mesh.name, "edges of a mesh", any_number,
                     [boxes](std::size_t, std::uint64_t seed) {
                       return std::make_unique<SwingingScene>(*boxes, seed);
                     },
                     boxes->size()});
  }
}

}  // namespace

std::vector<SceneKind> sceneKinds(const std::string& piles, const std::string& meshes) {
  std::vector<SceneKind> kinds;
  for (const sap_test::BoxScene& scene : sap_test::boxScenes()) kinds.push_back(ofTests(scene));
  kinds.push_back(swinging("log-sizes-2", "sizes over two decades", any_number,
                           [](std::size_t n, std::uint64_t seed) { return logSizes(n, 2, seed); }));
  kinds.push_back(swinging("log-sizes-6", "sizes over six decades", any_number,
                           [](std::size_t n, std::uint64_t seed) { return logSizes(n, 6, seed); }));
  kinds.push_back(
      swinging("bars-among-cubes", "every tenth 1 x 1 x 40", any_number, barsAmongCubes));
  kinds.push_back(swinging("thin-bars", "1 x 1 x 20 along each axis", any_number, thinBars));
  kinds.push_back({"trembling", "a dense cube, each box by a thousandth a frame", any_number,
                   [](std::size_t n, std::uint64_t seed) {
                     return std::make_unique<SwingingScene>(centred(sap_test::denseCube(n, seed)),
                                                            seed, 0.001);
                   }});
  kinds.push_back(
      jumping("jumps", "a dense cube, each box anywhere in each frame", any_number, false));
  kinds.push_back(jumping("crowd-and-cube",
                          "jumps in a cube of side 5 and in a dense one, eight frames each", 10000,
                          true));
  kinds.push_back(broadmark("brownian", "Broadmark: hundredth of the velocities new a frame",
                            BroadmarkScene::Brownian, false));
  kinds.push_back(broadmark("brownian-assorted", "Broadmark: sizes 0.5 to 2, a tenth long bars",
                            BroadmarkScene::Brownian, true));
  kinds.push_back(broadmark("gravity", "Broadmark: 4 g in a direction that turns",
                            BroadmarkScene::Gravity, false));
  kinds.push_back(swinging("cloth", "edges of a cloth in folds", any_number, cloth));
  addPiles(kinds, piles);
  if (!meshes.empty()) addMeshes(kinds, meshes);
  return kinds;
}

}  // namespace bench
