#include "bench_scenes.h"

#include <algorithm>
#include <cmath>

#include "random.h"
#include "recorded_scenes.h"
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

// The scenes of Broadmark (Serpa and Rodrigues: Broadmark, a testing framework for broad-phase
// collision detection algorithms, 2020): free bodies in a cube that they fill to a tenth, started
// inside a ball, thrown back by the walls. They do not hinder one another.
class BroadmarkScene : public MovingScene {
 public:
  enum Motion { Brownian, Gravity };

  BroadmarkScene(std::size_t n, std::uint64_t seed, Motion motion)
      : motion_(motion), random_(seed) {
    side_ = std::cbrt(static_cast<double>(n) / 0.1);
    velocities_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      boxes_.push_back(inBall());
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
SceneKind swinging(const char* name, const char* about, Make make, double part = 0.1) {
  return {name, about, any_number, [=](std::size_t n, std::uint64_t seed) {
            return std::make_unique<SwingingScene>(make(n, seed), seed, part);
          }};
}

SceneKind broadmark(const char* name, const char* about, BroadmarkScene::Motion motion) {
  return {name, about, any_number, [=](std::size_t n, std::uint64_t seed) {
            return std::make_unique<BroadmarkScene>(n, seed, motion);
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

}  // namespace

std::vector<SceneKind> sceneKinds(const std::string& piles) {
  std::vector<SceneKind> kinds;
  for (const sap_test::BoxScene& scene : sap_test::boxScenes()) kinds.push_back(ofTests(scene));
  kinds.push_back(swinging("bars-among-cubes", "every tenth 1 x 1 x 40", barsAmongCubes));
  kinds.push_back(swinging(
      "trembling", "a dense cube, each box by a thousandth a frame",
      [](std::size_t n, std::uint64_t seed) { return centred(sap_test::denseCube(n, seed)); },
      0.001));
  kinds.push_back(broadmark("brownian", "Broadmark: hundredth of the velocities new a frame",
                            BroadmarkScene::Brownian));
  kinds.push_back(
      broadmark("gravity", "Broadmark: 4 g in a direction that turns", BroadmarkScene::Gravity));
  for (const SceneKind& pile : pileScenes(piles)) kinds.push_back(pile);
  return kinds;
}

}  // namespace bench
