// Cells of the sweep that are kept from frame to frame: the pairs are those of the boxes as they
// are now, and cells whose boxes went apart are kept no more.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "space/extract/paper/brute_force.h"
#include "space/extract/sweep.h"
#include "support/case.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace ode_parallel_sap;

namespace {

// Boxes in motion, swept with cells that may be older than the boxes and tested all with all.
template <class Real>
class Scene {
 public:
  Scene(std::size_t count, std::uint64_t seed) : random(seed), side_(std::cbrt(count / 2.0)) {
    boxes.wide = sizeof(Real) > sizeof(float);
    boxes.exact = true;
    for (std::size_t i = 0; i < count; ++i) add();
  }

  void add() {
    BasicBox<Real> box;
    for (int axis = 0; axis < 3; ++axis) {
      box.lower[axis] = static_cast<Real>(random.between(0, side_));
      box.upper[axis] = box.lower[axis] + static_cast<Real>(random.between(0.5, 1.5));
    }
    all().push_back(box);
    boxes.size = all().size();
  }
  void shift(std::size_t slot, double most) {
    for (int axis = 0; axis < 3; ++axis) {
      const Real step = static_cast<Real>(random.between(-most, most));
      all()[slot].lower[axis] += step;
      all()[slot].upper[axis] += step;
    }
  }
  void shiftAll(double most) {
    for (std::size_t slot = 0; slot < boxes.size; ++slot) shift(slot, most);
  }
  void shuffle() { sap_test::shuffle(all().data(), boxes.size, random); }
  BasicBox<Real>& operator[](std::size_t slot) { return all()[slot]; }

  // A frame. Returns whether the cells were kept.
  bool step(int threads = 2) {
    const std::vector<Pair> swept = found(sweep_, boxes, threads, list_);
    REQUIRE(swept == found(all_with_all_, boxes, 1, list_));
    return sweep_.keptCells();
  }

  BoxSet boxes;
  sap_test::Random random;

 private:
  Buffer<BasicBox<Real>>& all() { return boxBufferOf<Real>(boxes); }

  double side_;
  Sweep<Real> sweep_;
  BruteForce<Real> all_with_all_;
  PairList list_;
};

constexpr double slow = 0.01, fast = 100;

template <class Real>
BasicBox<Real> nowhere() {
  BasicBox<Real> box;
  std::fill(box.lower, box.lower + 3, std::numeric_limits<Real>::quiet_NaN());
  std::fill(box.upper, box.upper + 3, std::numeric_limits<Real>::quiet_NaN());
  return box;
}

template <class Real>
void checkSlowMotion(std::uint64_t seed) {
  Scene<Real> scene(1500, seed);
  CHECK(!scene.step());
  int kept = 0, frames = 100;
  for (int frame = 0; frame < frames; ++frame) {
    scene.shiftAll(slow);
    kept += scene.step(1 + frame % 3);
  }
  CHECK(kept > 9 * frames / 10);
  CHECK(kept < frames);  // what drifts without growing is found out at last
}

// What ends the cells of a scene, in that very frame.
template <class Real>
void checkEnd(const char* what, std::uint64_t seed, const std::function<void(Scene<Real>&)>& end) {
  INFO(what);
  Scene<Real> scene(1500, seed);
  scene.step();
  scene.shiftAll(slow);
  REQUIRE(scene.step());
  end(scene);
  CHECK(!scene.step());
  scene.step();
  scene.shiftAll(slow);
  scene.step();
}

template <class Real>
void checkEnds(std::uint64_t seed) {
  constexpr Real infinity = std::numeric_limits<Real>::infinity();
  using S = Scene<Real>;
  checkEnd<Real>("all far away", seed, [](S& scene) { scene.shiftAll(fast); });
  checkEnd<Real>("boxes change places", seed, [](S& scene) { scene.shuffle(); });
  checkEnd<Real>("a few far away", seed, [](S& scene) {
    for (int i = 0; i < 20; ++i) scene.shift(scene.random.below(scene.boxes.size), 1000 * fast);
  });
  checkEnd<Real>("all larger", seed, [](S& scene) {
    for (std::size_t i = 0; i < scene.boxes.size; ++i)
      for (Real& bound : scene[i].upper) bound += 3;
  });
  checkEnd<Real>("one infinite", seed, [=](S& scene) { scene[7].upper[1] = infinity; });
  checkEnd<Real>("one gone", seed, [](S& scene) { scene[7] = nowhere<Real>(); });
  checkEnd<Real>("one gone, another come", seed, [](S& scene) {
    const BasicBox<Real> box = scene[7];
    scene[7] = nowhere<Real>();
    scene.step();
    scene.step();
    scene[8] = nowhere<Real>();
    scene[7] = box;
  });
  checkEnd<Real>("one more", seed, [](S& scene) { scene.add(); });
  checkEnd<Real>("fewer slots", seed, [](S& scene) { scene.boxes.size -= 100; });
}

}  // namespace

TEST_CASE("Cells are kept while boxes move slowly", "[drift]") {
  const std::uint64_t seed = sap_test::seedOr(1);
  INFO("seed " << seed);
  checkSlowMotion<float>(seed);
  checkSlowMotion<double>(seed);
}

TEST_CASE("Cells end with the frame in which they serve no more", "[drift]") {
  const std::uint64_t seed = sap_test::seedOr(1);
  INFO("seed " << seed);
  checkEnds<float>(seed);
  checkEnds<double>(seed);
}

TEST_CASE("A plane among the boxes does not keep their cells from being kept", "[drift]") {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Scene<float> scene(1500, sap_test::seedOr(1));
  scene[3] = {{-infinity, -infinity, -infinity}, {infinity, infinity, 0.5f}};
  scene.step();
  int kept = 0;
  for (int frame = 0; frame < 10; ++frame) {
    scene.shiftAll(slow);
    kept += scene.step();
  }
  CHECK(kept == 10);
  // What was without bounds has some now, and the other way round.
  std::swap(scene[3], scene[4]);
  scene.step();
  scene[4] = {{0, 0, 0}, {1, 1, 1}};
  scene.step();
}

TEST_CASE("Cells that came apart in each frame are kept again once they stay together", "[drift]") {
  Scene<float> scene(1500, sap_test::seedOr(1));
  for (int frame = 0; frame < 50; ++frame) {
    scene.shuffle();
    CHECK(!scene.step());
  }
  // Not at once: attempts have become rare.
  int kept = 0;
  for (int frame = 0; frame < 150; ++frame) {
    scene.shiftAll(slow / 10);
    kept += scene.step();
  }
  CHECK(kept > 50);
}

TEST_CASE("Cells that go apart as wholes end with the frame, too", "[drift]") {
  // Sixteen boxes to a swarm, and a swarm to a cell: no cell ever grows.
  Scene<float> scene(0, sap_test::seedOr(1));
  constexpr std::size_t swarms = 300;
  for (std::size_t i = 0; i < 16 * swarms; ++i) scene.add();
  const auto place = [&](double side) {
    for (std::size_t swarm = 0; swarm < swarms; ++swarm)
      for (int axis = 0; axis < 3; ++axis) {
        const float low = static_cast<float>(scene.random.between(0, side));
        for (std::size_t i = 0; i < 16; ++i) {
          scene[16 * swarm + i].lower[axis] = low;
          scene[16 * swarm + i].upper[axis] = low + 1;
        }
      }
  };
  place(1000);
  scene.step();
  REQUIRE(scene.step());
  place(1000);
  CHECK(!scene.step());
}

TEST_CASE("A scene may be empty for some frames", "[drift]") {
  Scene<double> scene(0, sap_test::seedOr(1));
  for (int frame = 0; frame < 3; ++frame) scene.step();
  scene.add();
  CHECK(!scene.step());
  scene.boxes.size = 0;
  for (int frame = 0; frame < 3; ++frame) scene.step();
}
