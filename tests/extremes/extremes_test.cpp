// Whatever a scene comes to, the pairs are exactly those owed, in order, and nothing aborts: what a
// broad phase meets in a program that has gone wrong, or is larger, smaller, faster or stranger
// than its author thought.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/floating_point.h"
#include "support/knobs.h"
#include "support/not_finite.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr dReal kLargest = std::numeric_limits<dReal>::max();
constexpr dReal kDenormal = std::numeric_limits<dReal>::denorm_min();
constexpr double kSmallestNormal = double(std::numeric_limits<dReal>::min());

template <class Value, std::size_t count>
Value any(Random& random, const Value (&values)[count]) {
  return values[random.below(count)];
}

// What is drawn for a scene.
struct Extreme {
  std::size_t size;  // geoms
  int threads;       // 0: not set
  unsigned mode;     // of floating-point numbers, in which the program collides
  bool user_boxes;   // whose extents no class rounds; else boxes of ODE's and a few others
  bool lattice;      // bounds are whole numbers of units
  double unit;       // side of most boxes
  double side;       // of the cube in which they are, in units
  double decades;    // of sizes, near the origin
  double far;        // where the cube is
  bool some_far;     // every other box is
  double elongated;  // how many extents are 1e6 times as long
  double strange;    // how many numbers are infinite, or otherwise rare
  double invalid;    // how many boxes are inverted, or NaN
  double moving;     // how many change in a frame
  bool rescales;     // all of them change their scale

  explicit Extreme(Random& random)
      : size(geomsOf(any(random, {25, 200, 700, 1200, 5000}))),
        threads(random.chance(0.5) ? 3 : 0),
        mode(FloatingPointMode::current()),
        user_boxes(random.chance(0.7)),
        lattice(random.chance(0.3)),
        unit(any(random, {1.0, 1.0, 0.1, 1e-30, 1e6, 1e30, double(kDenormal), kSmallestNormal,
                          0.01 * double(kLargest)})),
        side(random.chance(0.1) ? 0 : 0.95 * std::cbrt(double(size))),
        decades(any(random, {0.0, 0.0, 0.0, 3.0, 300.0})),
        far(any(random, {0.0, 0.0, 0.0, 1e6, 1e9, 1e12, 1e15, 1e18, 1e30})),
        some_far(random.chance(0.3)),
        elongated(any(random, {0.0, 0.0, 0.0, 0.01, 0.3})),
        strange(any(random, {0.0, 0.0, 0.002, 0.05, 0.5})),
        invalid(any(random, {0.0, 0.0, 0.02, 0.3})),
        moving(any(random, {0.0, 0.02, 0.5, 1.0})),
        rescales(random.chance(0.1)) {
    // ODE, where it flushes denormals, makes no geoms of them.
    user_boxes = user_boxes || unit <= kSmallestNormal;
    using Mode = FloatingPointMode;
    if (Mode::kCanBeSet && random.chance(0.5))
      mode = any(random, {Mode::kFlushing, Mode::kDownward, Mode::kUpward, Mode::kTowardZero,
                          Mode::kTrapping});
    // What ODE's own computations come to is the program's matter in any mode.
    if (!user_boxes && mode == Mode::kTrapping) mode = Mode::current();
    // Where most boxes overlap.
    if (side == 0 || strange > 0.1 || far > 1e12 * unit) size = std::min<std::size_t>(size, 700);
  }
};

// A space of the kind under test. The same random numbers make the same calls.
class Scene : private Space, public World {
 public:
  Scene(const Configuration& configuration, const Extreme& extreme, std::uint64_t seed)
      : Space(configuration), World(dSpaceID(*this)), extreme_(extreme), random_(seed) {
    if (extreme.threads > 0) dParallelSAPSpaceSetNumThreads(space(), extreme.threads);
  }

  // Builds the scene in frame 0 and changes it in the frames after that.
  void play(int frame) {
    const double scales[] = {1, 1e-30, 1e30, 1e-6};
    unit_ = extreme_.unit * (extreme_.rescales ? scales[frame % 4] : 1);
    for (std::size_t i = 0; i < extreme_.size; ++i) {
      if (frame == 0) take(extreme_.user_boxes ? createUserBox(space(), Bounds()) : create(i));
      if (frame > 0 && !extreme_.rescales && !random_.chance(extreme_.moving)) continue;
      if (extreme_.user_boxes) {
        setUserBounds(geoms()[i], bounds(i));
      } else {
        const dReal at[] = {place(i), place(i), place(i)};
        dGeomSetPosition(geoms()[i], at[0], at[1], at[2]);
      }
    }
  }

 private:
  double farOf(std::size_t i) const { return extreme_.some_far && i % 2 ? 0 : extreme_.far; }

  dReal place(std::size_t i) {
    if (random_.chance(extreme_.strange / 4)) return random_.chance(0.5) ? kInfinity : -kInfinity;
    return real(farOf(i) + unit_ * random_.between(0, extreme_.side));
  }

  dGeomID create(std::size_t i) {
    const dReal length = random_.chance(extreme_.strange) ? kInfinity : real(unit_);
    if (i % 8 == 1) return dCreateSphere(space(), length / 2);
    if (i % 8 == 2) return dCreateCapsule(space(), real(unit_) / 4, length);
    if (i % 50 == 3) return dCreateRay(space(), length);
    return dCreateBox(space(), real(unit_), length, real(unit_));
  }

  Bounds bounds(std::size_t i) {
    Bounds bounds;
    const double size = std::pow(10, -extreme_.decades * random_.unit());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double at = random_.between(0, extreme_.side), extent = size;
      if (extreme_.decades > 0) at = size * random_.between(-3, 3);
      if (random_.chance(extreme_.elongated)) extent *= 1e6;
      if (extreme_.lattice) {
        at = std::floor(at);
        extent = double(random_.below(3));
      }
      bounds[2 * axis] = real(farOf(i) + at * unit_);
      bounds[2 * axis + 1] = real(farOf(i) + (at + extent) * unit_);
    }
    for (std::size_t k = 0; k < 6; ++k) {
      if (!random_.chance(extreme_.strange)) continue;
      const dReal value = any(
          random_, {kInfinity, kInfinity, kLargest, kLargest / 2, dReal(1), kDenormal, dReal(0)});
      bounds[k] = random_.chance(0.9) == (k % 2 == 1) ? value : -value;
    }
    if (!random_.chance(extreme_.invalid)) return bounds;
    const std::size_t axis = random_.below(3);
    if (random_.chance(0.5))
      std::swap(bounds[2 * axis], bounds[2 * axis + 1]);
    else
      bounds[random_.below(6)] = kNaN;
    return bounds;
  }

  const Extreme& extreme_;
  Random random_;
  double unit_ = 1;
};

// What dSpaceCollide2 finds with some geoms that are in no space: boxes as large as one of the
// scene's, infinite ones and inverted ones.
std::string differenceOfProbes(const Extreme& extreme, const Scene& scene) {
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

// Plays a scene of each configuration in step: the same calls give the same bounds, so the pairs
// owed are worked out once a frame. Returns the first thing that is wrong, or "".
std::string play(std::uint64_t seed) {
  const Messages nan_reports;  // contract_test counts them
  Random random(seed);
  const Extreme extreme(random);
  std::vector<std::unique_ptr<Scene>> scenes;
  for (const Configuration& configuration : configurations())
    scenes.push_back(std::make_unique<Scene>(configuration, extreme, seed));
  for (int frame = 0; frame < 4; ++frame) {
    Pairs expected;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      scenes[i]->play(frame);
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
      return std::to_string(extreme.size) + " geoms, frame " + std::to_string(frame) + ", " +
             configurations()[i].name + ": " + problem;
    }
  }
  return "";
}

}  // namespace

TEST_CASE("At every extreme every configuration finds exactly the pairs and geoms owed",
          "[extremes]") {
  for (int run = 0; run < scaled(200); ++run) {
    INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seedOr(1, run));
    CHECK(play(seedOr(1, run)) == "");
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
