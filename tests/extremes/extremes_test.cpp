// Whatever a scene comes to, the pairs are exactly those owed, in order, and nothing aborts.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "extremes/extreme.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/floating_point.h"
#include "support/knobs.h"
#include "support/not_finite.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

// What dSpaceCollide2 finds with some geoms that are in no space: boxes as large as one of the
// scene's, infinite ones and inverted ones.
std::string differenceOfProbes(const Extreme& extreme, Scene& scene) {
  Random random(scene.geoms().size());
  std::vector<Bounds> probes = {
      {-kInfinity, kInfinity, -kInfinity, kInfinity, -kInfinity, kInfinity},
      {1, 0, 1, 0, 1, 0},
      {0, kInfinity, 1, 2, 1, 2},
      {0, 0, 0, 0, 0, 0}};
  for (int i = 0; i < 4 && !scene.geoms().empty(); ++i)
    probes.push_back(boundsOf(scene.geoms()[random.below(scene.geoms().size())]));
  constexpr std::size_t number_of_probe = 1000000;
  for (const Bounds& bounds : probes) {
    const dGeomID probe = createUserBox(nullptr, bounds);
    setNumber(probe, number_of_probe);
    Pairs got, expected;
    {
      const FloatingPointMode mode(extreme.mode);
      got = collide2(scene.space(), probe);
    }
    const FloatingPointMode exact(FloatingPointMode::kDefault);
    for (const dGeomID geom : scene.geoms())
      if (takesPart(geom) && takesPart(probe) && mayTouch(geom, probe))
        expected.emplace_back(number(geom), number_of_probe);
    dGeomDestroy(probe);
    const std::string problem = difference(got, expected);
    if (!problem.empty()) return "dSpaceCollide2: " + problem;
  }
  return "";
}

// Plays the extreme on one scene for each configuration, in step: the same calls give the same
// bounds, so the pairs owed are worked out once a frame. Returns the first thing that is wrong, or
// "".
std::string play(const Extreme& extreme, std::size_t size, int threads, int frames) {
  const Messages nan_reports;  // contract_test counts them
  std::vector<std::unique_ptr<Scene>> scenes;
  for (const Configuration& configuration : configurations()) {
    scenes.push_back(std::make_unique<Scene>(configuration, threads, size, seedOr(size)));
  }
  for (int frame = 0; frame < frames; ++frame) {
    Pairs expected;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      extreme.play(*scenes[i], frame);
      // Queries come before the frame and after it, in turn.
      std::string problem = frame % 2 ? differenceOfProbes(extreme, *scenes[i]) : "";
      Pairs got;
      {
        const FloatingPointMode mode(extreme.mode);
        got = collide(scenes[i]->space());
      }
      const FloatingPointMode exact(FloatingPointMode::kDefault);
      // After the space had to bring the bounds up to date.
      if (i == 0) expected = expectedPairs(scenes[0]->geoms());
      if (problem.empty()) problem = difference(got, expected);
      if (problem.empty() && frame % 2 == 0) problem = differenceOfProbes(extreme, *scenes[i]);
      if (problem.empty()) continue;
      return extreme.name + ", " + std::to_string(size) + " geoms, frame " + std::to_string(frame) +
             ", " + configurations()[i].name + ", " + std::to_string(threads) +
             " threads, ODE_PARALLEL_SAP_TEST_SEED=" + std::to_string(seedOr(size)) + ": " +
             problem;
    }
  }
  return "";
}

}  // namespace

TEST_CASE("At every extreme every configuration finds exactly the pairs and geoms owed",
          "[extremes]") {
  for (const Extreme& extreme : extremes()) {
    for (const std::size_t size : {std::size_t{25}, std::size_t{200}, geomsOf(1200)}) {
      CHECK(play(extreme, std::min(size, extreme.most), 0, extreme.frames) == "");
    }
  }
}

TEST_CASE("At every extreme any number of threads finds exactly the pairs and geoms owed",
          "[extremes]") {
  for (const Extreme& extreme : extremes()) {
    CHECK(play(extreme, geomsOf(extreme.most), 3, 2) == "");
  }
}

#if defined(EXTREMES_FAST_MATH)
#if !defined(__FAST_MATH__)
#error "to be compiled with -ffast-math"
#endif

TEST_CASE("Denormals are flushed from the start of the program on", "[extremes]") {
  if (!FloatingPointMode::kCanBeSet) return;
  CHECK(FloatingPointMode::current() == FloatingPointMode::kFlushing);
}
#endif
