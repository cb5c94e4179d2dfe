#include "bench_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "random.h"
#include "scenes.h"
#include "swing.h"

namespace bench {

using sap_test::Random;

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

MovingScene partlyMoving(MovingScene whole, double part, bool same) {
  if (part >= 1) return whole;
  std::vector<std::size_t> movers;
  for (std::size_t i = 0; i < whole.boxes.size(); ++i)
    if (std::floor(part * static_cast<double>(i + 1)) > std::floor(part * static_cast<double>(i)))
      movers.push_back(i);
  const Boxes boxes = whole.boxes;
  return {boxes, [=, random = Random(3)](Boxes& shown) mutable {
            whole.next();
            for (std::size_t& i : movers) {
              if (!same) i = random.below(shown.size());
              shown[i] = whole.boxes[i];
            }
          }};
}

namespace {

using Velocities = std::vector<std::array<double, 3>>;

CentredBox cube(double x, double y, double z, double half) {
  const dReal h = static_cast<dReal>(half);
  return {{static_cast<dReal>(x), static_cast<dReal>(y), static_cast<dReal>(z)}, {h, h, h}};
}

Boxes centred(const sap_test::Boxes& boxes) {
  Boxes all(boxes.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double low = boxes[i].low[axis], high = boxes[i].high[axis];
      all[i].centre[axis] = static_cast<dReal>((low + high) / 2);
      all[i].half[axis] = static_cast<dReal>((high - low) / 2);
    }
  return all;
}

// Every box goes back and forth around its place, in each frame by up to this part of its width
// along each axis, so that the distribution stays what it is.
MovingScene swinging(const Boxes& places, std::uint64_t seed, double part) {
  Random random(seed ^ 0x5377696e67u);
  Velocities velocities(places.size());
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      velocities[i][axis] =
          static_cast<float>(places[i].half[axis] * random.between(-2 * part, 2 * part));
  return {places, [=, frame = 0](Boxes& boxes) mutable {
            const int way = swing(++frame);
            for (std::size_t i = 0; i < boxes.size(); ++i)
              for (std::size_t axis = 0; axis < 3; ++axis)
                boxes[i].centre[axis] =
                    places[i].centre[axis] + static_cast<dReal>(velocities[i][axis]) * way;
          }};
}

// All boxes move together, by a distance that rounds nothing: what touches goes on touching.
MovingScene shifting(const Boxes& places) {
  return {places, [=, frame = 0](Boxes& boxes) mutable {
            const dReal way = static_cast<dReal>(swing(++frame)) / 16;
            for (std::size_t i = 0; i < boxes.size(); ++i)
              for (int axis = 0; axis < 3; ++axis)
                boxes[i].centre[axis] = places[i].centre[axis] + way;
          }};
}

// The scenes of Broadmark (Serpa and Rodrigues: Broadmark, a testing framework for broad-phase
// collision detection algorithms, 2020): free bodies in a cube that they fill to a tenth, started
// inside a ball, thrown back by the walls. They do not hinder one another. Brownian, a hundredth of
// the velocities is new in each frame; else they fall in a direction that turns.
MovingScene broadmark(std::size_t n, std::uint64_t seed, bool brownian) {
  constexpr double dt = 1.0 / 60;
  const double side = std::cbrt(static_cast<double>(n) / 0.1);
  Random random(seed);
  const auto anySpeed = [side](Random& any) {
    return any.between(-0.75, 0.75) * side / std::sqrt(3.0);
  };
  Boxes places;
  Velocities velocities(n);
  while (places.size() < n) {
    double p[3], square = 0;
    for (double& x : p) {
      x = random.between(-0.45, 0.45);
      square += x * x;
    }
    if (square > 0.45 * 0.45) continue;
    for (double& v : velocities[places.size()]) v = anySpeed(random);
    places.push_back(cube(p[0] * side, p[1] * side, p[2] * side, 0.5));
  }
  return {places, [=, frame = 0](Boxes& boxes) mutable {
            for (std::size_t i = 0; brownian && i < n / 100; ++i)
              for (double& v : velocities[random.below(n)]) v = anySpeed(random);
            const double turn = 0.02 * ++frame, g = brownian ? 0 : 4 * 9.81, wall = side / 2;
            const double pull[3] = {g * std::sin(turn), g * std::sin(turn / 3) * std::cos(turn),
                                    -g * std::cos(turn / 3) * std::cos(turn)};
            for (std::size_t i = 0; i < n; ++i)
              for (std::size_t axis = 0; axis < 3; ++axis) {
                double& v = velocities[i][axis];
                v += pull[axis] * dt;
                double x = static_cast<double>(boxes[i].centre[axis]) + v * dt;
                if (x > wall || x < -wall) {
                  x = std::clamp(2 * std::copysign(wall, x) - x, -wall, wall);
                  v = -v;
                }
                boxes[i].centre[axis] = static_cast<dReal>(x);
              }
          }};
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

SceneKind ofTests(const sap_test::BoxScene& scene) {
  std::string name = scene.name;
  std::replace(name.begin(), name.end(), ' ', '-');
  const auto make = scene.make;
  const bool touching = make == sap_test::touchingLattice || make == sap_test::onePlace;
  return {name, "of the tests",
          [=](std::size_t n, std::uint64_t seed) {
            const Boxes boxes = centred(make(n, seed));
            return touching ? shifting(boxes) : swinging(boxes, seed, 0.1);
          },
          make == sap_test::onePlace   ? 3000
          : make == sap_test::longBars ? 100000
                                       : any_number};
}

MovingScene shaking(std::size_t n, std::uint64_t seed) {
  const Boxes places = centred(sap_test::denseCube(n, seed));
  return {places, [=, random = Random(seed)](Boxes& boxes) mutable {
            for (std::size_t i = 0; i < n; ++i)
              for (int axis = 0; axis < 3; ++axis)
                boxes[i].centre[axis] =
                    places[i].centre[axis] + static_cast<dReal>(random.between(-0.01, 0.01));
          }};
}

}  // namespace

std::vector<SceneKind> sceneKinds(const std::string& piles) {
  std::vector<SceneKind> kinds;
  for (const sap_test::BoxScene& scene : sap_test::boxScenes()) kinds.push_back(ofTests(scene));
  const auto add = [&](const char* name, const char* about, auto make) {
    kinds.push_back({name, about, make});
  };
  add("bars-among-cubes", "every tenth 1 x 1 x 40", [](std::size_t n, std::uint64_t seed) {
    return swinging(barsAmongCubes(n, seed), seed, 0.1);
  });
  add("trembling", "a dense cube, each box by a thousandth a frame",
      [](std::size_t n, std::uint64_t seed) {
        return swinging(centred(sap_test::denseCube(n, seed)), seed, 0.001);
      });
  add("shaking", "a dense cube, each box within a hundredth of its place", shaking);
  add("some-shaking", "a hundredth of these boxes, others in each frame",
      [](std::size_t n, std::uint64_t seed) {
        return partlyMoving(shaking(n, seed), 0.01, false);
      });
  add("brownian", "Broadmark: hundredth of the velocities new a frame",
      [](std::size_t n, std::uint64_t seed) { return broadmark(n, seed, true); });
  add("gravity", "Broadmark: 4 g in a direction that turns",
      [](std::size_t n, std::uint64_t seed) { return broadmark(n, seed, false); });
  for (const SceneKind& pile : pileScenes(piles)) kinds.push_back(pile);
  return kinds;
}

}  // namespace bench
