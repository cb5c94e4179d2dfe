#include "cuda/check/scenes.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <random>
#include <stdexcept>

namespace cuda_check {

using ode_parallel_sap::Box;
using ode_parallel_sap::BoxSet;

namespace {

constexpr float inf = std::numeric_limits<float>::max();  // what stands for it in a BoxSet

struct Random {
  std::mt19937_64 engine;
  explicit Random(std::uint64_t seed) : engine(seed) {}
  double unit() { return (engine() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  std::size_t below(std::size_t n) { return engine() % n; }
};

void start(std::size_t n, BoxSet& boxes) {
  boxes.size = n;
  boxes.wide = boxes.exact = boxes.filter_bits = boxes.filter_bodies = false;
  boxes.boxes.resizeDiscarding(n);
}

void put(Box& box, const double* centre, const double* half) {
  for (int axis = 0; axis < 3; ++axis) {
    box.lower[axis] = static_cast<float>(centre[axis] - half[axis]);
    box.upper[axis] = static_cast<float>(centre[axis] + half[axis]);
  }
}
void putCube(Box& box, double x, double y, double z, double half) {
  const double centre[3] = {x, y, z}, halves[3] = {half, half, half};
  put(box, centre, halves);
}

// Unit cubes, about 4.5 pairs a box.
void cube(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  Random random(seed);
  const double side = 0.95 * std::cbrt(static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    putCube(boxes.boxes[i], random.between(0, side), random.between(0, side),
            random.between(0, side), 0.5);
}

// Boxes of all sizes up to two, about as many pairs. Each comes three times, turned from axis to
// axis, so that all axes are alike to the last digit.
void sizes(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  Random random(seed);
  const double side = 1.05 * std::cbrt(static_cast<double>(n));
  double centre[3] = {}, half[3] = {};
  for (std::size_t i = 0; i < n; ++i) {
    if (i % 3 == 0)
      for (int axis = 0; axis < 3; ++axis) {
        centre[axis] = random.between(0, side);
        half[axis] = random.unit();
      }
    std::rotate(centre, centre + 1, centre + 3);
    std::rotate(half, half + 1, half + 3);
    if (i < n / 3 * 3)
      put(boxes.boxes[i], centre, half);
    else
      putCube(boxes.boxes[i], centre[0], centre[0], centre[0], half[0]);
  }
}

// Points: one at each power of two along the diagonal, all others at the origin. Each round of
// dividing clusters tells but a few from the rest.
void powers(std::size_t n, std::uint64_t, BoxSet& boxes) {
  start(n, boxes);
  int power = 126;
  for (std::size_t i = 0; i < n; ++i) {
    const double place = i % 9 == 4 && power >= -149 ? std::ldexp(1.0, power) : 0;
    if (place > 0) power -= 6;
    putCube(boxes.boxes[i], place, place, place, 0);
  }
}

// Slots follow the place, as where a program adds its geoms row by row.
void rows(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  Random random(seed);
  const std::size_t side = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(n))));
  for (std::size_t i = 0; i < n; ++i)
    putCube(boxes.boxes[i], 0.95 * (i % side) + random.between(-0.3, 0.3),
            0.95 * (i / side % side) + random.between(-0.3, 0.3),
            0.95 * (i / side / side) + random.between(-0.3, 0.3), 0.5);
}

// Touching faces, edges and corners: 13 pairs a box, all borderline.
void lattice(std::size_t n, std::uint64_t, BoxSet& boxes) {
  start(n, boxes);
  const std::size_t side = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(n))));
  for (std::size_t i = 0; i < n; ++i)
    putCube(boxes.boxes[i], i % side, i / side % side, i / side / side, 0.5);
}

void layer(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  Random random(seed);
  const double side = 0.68 * std::sqrt(static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    putCube(boxes.boxes[i], random.between(0, side), random.between(0, side),
            random.between(0, 0.1), 0.5);
}

void line(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  Random random(seed);
  for (std::size_t i = 0; i < n; ++i)
    putCube(boxes.boxes[i], random.between(0, 0.22 * n), 0, 0, 0.5);
}

// Dense heaps of a hundred to ten thousand, far from each other.
void clusters(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  Random random(seed);
  const double world = 100 * std::cbrt(static_cast<double>(n));
  for (std::size_t i = 0; i < n;) {
    const std::size_t size = static_cast<std::size_t>(std::pow(10, random.between(2, 4)));
    const double x = random.between(0, world), y = random.between(0, world),
                 z = random.between(0, world), side = std::cbrt(static_cast<double>(size));
    for (std::size_t end = std::min(n, i + size); i < end; ++i)
      putCube(boxes.boxes[i], x + random.between(0, side), y + random.between(0, side),
              z + random.between(0, side), 0.5);
  }
}

// Sizes over four decades, as many of each octave, in a space that keeps pairs few.
void decades(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  Random random(seed);
  double volume = 0;
  std::vector<double> halves(n);
  for (double& half : halves) {
    half = 0.5 * std::pow(10, -4 * std::sqrt(random.unit()));
    volume += 8 * half * half * half;
  }
  const double side = std::cbrt(volume) * 0.55;
  for (std::size_t i = 0; i < n; ++i)
    putCube(boxes.boxes[i], random.between(0, side), random.between(0, side),
            random.between(0, side), halves[i]);
}

// Every tenth a bar, forty times as long as the cubes.
void bars(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  cube(n, seed, boxes);
  Random random(seed + 1);
  const double side = 1.45 * std::cbrt(static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i) {
    double half[3] = {0.4, 0.4, 0.4};
    if (i % 10 == 0) half[random.below(3)] = 16;
    const double centre[3] = {random.between(0, side), random.between(0, side),
                              random.between(0, side)};
    put(boxes.boxes[i], centre, half);
  }
}

// Lists as long as what treats lists by their length has limits, and one more or less: a beam, then
// as many cubes in it as its list has pairs. These are apart or, with even seeds, meet the next
// eight each, so that rows are of other lengths.
void beams(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  constexpr std::size_t lengths[] = {0, 1, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65, 500};
  const double half = seed % 2 ? 0.4 : 4;
  std::size_t beam = 0;
  for (std::size_t i = 0; i < n; ++beam) {
    const double y = 20.0 * static_cast<double>(beam);
    const std::size_t length = std::min(lengths[beam % std::size(lengths)], n - i - 1);
    const double middle = 0.5 * static_cast<double>(length);
    const double centre[3] = {middle, y, 0}, halves[3] = {middle + 1, 0.5, 0.5};
    put(boxes.boxes[i++], centre, halves);
    for (std::size_t k = 0; k < length; ++k)
      putCube(boxes.boxes[i++], static_cast<double>(k), y, 0, half);
  }
}

// One box holds all the others.
void giant(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  cube(n, seed, boxes);
  const double side = std::cbrt(static_cast<double>(n));
  if (n) putCube(boxes.boxes[n / 3], side / 2, side / 2, side / 2, side);
}

// Another is so far away that the rest share one step of any even grid.
void outlier(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  cube(n, seed, boxes);
  if (n) putCube(boxes.boxes[n / 2], 1e30, -1e30, 1e30, 1);
  if (n > 3) putCube(boxes.boxes[n / 2 + 1], 1e15, 1e15, 1e15, 1);
}

void sameSpot(std::size_t n, std::uint64_t, BoxSet& boxes) {
  start(n, boxes);
  for (std::size_t i = 0; i < n; ++i) putCube(boxes.boxes[i], 3, 4, 5, 0.5);
}

// All kinds of bounds that are legal and rare; coordinates on a coarse grid, so that many are
// equal.
void strange(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  start(n, boxes);
  Random random(seed);
  const double side = 1.3 * std::cbrt(static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i) {
    Box& box = boxes.boxes[i];
    putCube(box, std::floor(random.between(-side, side) * 4) / 8,
            std::floor(random.between(-side, side) * 4) / 8,
            std::floor(random.between(-side, side) * 4) / 8, 0.5);
    const int axis = static_cast<int>(random.below(3));
    switch (random.below(24)) {
      case 0:
        for (int a = 0; a < 3; ++a) box.lower[a] = box.upper[a] = std::nanf("");
        break;
      case 1:
        std::swap(box.lower[axis], box.upper[axis]);
        break;
      case 2:
        box.upper[axis] = box.lower[axis];
        break;
      case 3:
        if (random.below(40) == 0) box.lower[axis] = -inf, box.upper[axis] = inf;
        break;
      case 4:
        if (random.below(40) == 0) box.upper[axis] = inf;
        break;
      case 5:
        if (random.below(40) == 0) box.lower[axis] = inf, box.upper[axis] = -inf;
        break;
      case 6:
        box.lower[axis] = -0.0f, box.upper[axis] = 1e-42f;
        break;
      case 7:
        box.lower[axis] = -1e-45f, box.upper[axis] = 0.0f;
        break;
      case 8:
        if (random.below(40) == 0) box.lower[axis] = -3.4e38f, box.upper[axis] = 3.4e38f;
        break;
      case 9:
        box.lower[axis] = 0.0f, box.upper[axis] = -0.0f;
        break;
      default:
        break;
    }
  }
}

// A third of the boxes are a dense cube of denormal size in the midst of the others.
void denormals(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  cube(n, seed, boxes);
  Random random(seed + 3);
  const double unit = 1e-43, side = 0.95 * std::cbrt(n / 3.0) * unit;
  for (std::size_t i = 0; i < n; i += 3)
    putCube(boxes.boxes[i], random.between(0, side), random.between(0, side),
            random.between(0, side), 0.5 * unit);
}

// The dense cube with bits and bodies.
void filtered(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  cube(n, seed, boxes);
  Random random(seed + 7);
  boxes.filter_bits = boxes.filter_bodies = true;
  boxes.bits.resizeDiscarding(n);
  boxes.bodies.resizeDiscarding(n);
  for (std::size_t i = 0; i < n; ++i) {
    boxes.bits[i] = {1u << random.below(4), static_cast<std::uint32_t>(random.below(16))};
    boxes.bodies[i] = random.below(n / 2 + 1) << 32;  // all 64 bits count
  }
}

void exactCube(std::size_t n, std::uint64_t seed, BoxSet& boxes) {
  cube(n, seed, boxes);
  boxes.exact = true;
}

}  // namespace

const std::vector<Scene>& scenes() {
  constexpr std::size_t any = std::numeric_limits<std::size_t>::max();
  static const std::vector<Scene> all = {
      {"cube", any, cube},           {"exact", any, exactCube},
      {"filtered", any, filtered},   {"rows", any, rows},
      {"lattice", any, lattice},     {"layer", any, layer},
      {"line", any, line},           {"clusters", any, clusters},
      {"decades", any, decades},     {"bars", any, bars},
      {"beams", any, beams},         {"giant", any, giant},
      {"outlier", any, outlier},     {"denormals", 200000, denormals},
      {"same spot", 6000, sameSpot}, {"powers", 1234, powers},
      {"sizes", any, sizes},         {"strange", 200000, strange}};
  return all;
}

const Scene& sceneOf(std::string_view name) {
  for (const Scene& scene : scenes())
    if (scene.name == name) return scene;
  throw std::invalid_argument("no scene is called " + std::string(name));
}

}  // namespace cuda_check
