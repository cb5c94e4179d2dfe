// Bounds that nobody should have: NaN, infinite, inverted, denormal, huge, far away.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/floating_point.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

const dReal kInfinity = std::numeric_limits<dReal>::infinity();
const dReal kLargest = std::numeric_limits<dReal>::max();
const dReal kDenormal = std::numeric_limits<dReal>::denorm_min();
const dReal kNaN = std::numeric_limits<dReal>::quiet_NaN();
const dReal kSignalling = std::numeric_limits<dReal>::signaling_NaN();

// Bounds that nobody should have, all of them with an order.
const std::vector<dReal>& extremes() {
  static const std::vector<dReal> values = {-kInfinity,
                                            -kLargest,
                                            -kLargest / 2,
                                            static_cast<dReal>(-1e30),
                                            -1,
                                            -kDenormal,
                                            dReal(-0.0),
                                            0,
                                            kDenormal,
                                            std::numeric_limits<dReal>::min(),
                                            1,
                                            dReal(1) + std::numeric_limits<dReal>::epsilon(),
                                            static_cast<dReal>(1e30),
                                            kLargest / 2,
                                            kLargest,
                                            kInfinity};
  return values;
}

Bounds extremeBounds(Random& random, bool inverted_too) {
  Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    dReal low = extremes()[random.below(extremes().size())];
    dReal high = extremes()[random.below(extremes().size())];
    if (low > high && !(inverted_too && random.chance(0.3))) std::swap(low, high);
    bounds[2 * axis] = low;
    bounds[2 * axis + 1] = high;
  }
  return bounds;
}

}  // namespace

TEST_CASE("A NaN bound leaves its geom out, is reported once, counted always, and heals",
          "[bounds]") {
  const unsigned modes[] = {FloatingPointMode::kDefault, FloatingPointMode::kTrapping,
                            FloatingPointMode::kFlushing};
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const int step = n > 1000 ? 5 : 1;
      for (int bound = 0; bound < 6; bound += step) {
        const Space space(configuration);
        World world(space);
        world.addBoxes(denseCube(n - 1, 8));
        const Bounds sound = {-100, 100, -100, 100, -100, 100};
        const dGeomID sick = world.take(createUserBox(space, sound));
        const Messages messages;
        INFO(configuration.name << ", " << n << " geoms, bound " << bound);
        const Pairs healthy = collide(space);
        REQUIRE(difference(healthy, expectedPairs(world.geoms())) == "");
        REQUIRE(statsOf(space).invalid == 0);
        REQUIRE(messages.all().empty());

        Bounds broken = sound;
        broken[bound] = bound % 5 == 0 ? kSignalling : bound % 2 ? kNaN : -kNaN;
        setUserBounds(sick, broken);
        for (const unsigned mode : modes) {
          Pairs got;
          {
            const FloatingPointMode scoped(mode);
            got = collide(space);
          }
          REQUIRE(difference(got, expectedPairs(world.geoms())) == "");
          REQUIRE(got.size() == healthy.size() - (n - 1));
          REQUIRE(statsOf(space).invalid == 1);
          REQUIRE(messages.all().size() == 1);
        }
        setUserBounds(sick, sound);
        REQUIRE(difference(collide(space), healthy) == "");
        REQUIRE(statsOf(space).invalid == 0);
        REQUIRE(messages.all().size() == 1);
      }
    }
  }
}

TEST_CASE("A geom with a NaN bound is in no pair of dSpaceCollide2", "[bounds]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.take(dCreateSphere(space, 1));
    const dGeomID sick = world.take(createUserBox(space, {0, 1, 0, kSignalling, 0, 1}));
    const dGeomID probe = dCreateSphere(nullptr, 1);
    setNumber(probe, 9);
    const Messages messages;
    const FloatingPointMode trapping(FloatingPointMode::kTrapping);
    INFO(configuration.name);
    CHECK(difference(collide2(space, probe), {{0, 9}}) == "");
    dSpaceRemove(space, sick);
    CHECK(collide2(space, sick).empty());
    CHECK(collide2(sick, space.geom()).empty());
    CHECK(messages.all().size() == 1);  // of the geom that was asked about, once
    dGeomDestroy(probe);
  }
}

TEST_CASE("A ray of infinite length along an axis is paired with what is on its way", "[bounds]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {1, 100, 1500}) {
      const Space space(configuration);
      World world(space);
      for (std::size_t i = 0; i < n; ++i)
        dGeomSetPosition(world.take(dCreateBox(space, 1, 1, 1)), -2 * dReal(i), -9, -9);
      const dGeomID ball = world.take(dCreateSphere(space, 1));
      const dGeomID ray = world.take(dCreateRay(space, kInfinity));
      const dGeomID probe = dCreateRay(nullptr, kInfinity);
      setNumber(probe, 9999);
      const Messages messages;
      INFO(configuration.name << ", " << n << " boxes");
      for (int frame = 0; frame < 12; ++frame) {
        dReal along[3] = {0, 0, 0};
        along[frame % 3] = frame % 2 ? 1 : -1;
        dGeomSetPosition(ball, 30 * along[0], 30 * along[1], 30 * along[2]);
        for (const dGeomID one : {ray, probe}) {
          dGeomRaySet(one, 0, 0, 0, along[0], along[1], along[2]);
          if (frame >= 6) (void)boundsOf(one);  // makes ODE write its NaN
        }
        REQUIRE(difference(collide2(space, probe), {{n, 9999}, {n + 1, 9999}}) == "");
        REQUIRE(difference(collide(space), {{n, n + 1}}) == "");
      }
      CHECK(statsOf(space).invalid == 0);
      CHECK(messages.all().empty());
      dGeomDestroy(probe);
    }
  }
}

TEST_CASE("Bounds that no float tells apart are told apart, around zero too", "[bounds]") {
  const dReal epsilon = std::numeric_limits<dReal>::epsilon();
  std::vector<std::array<dReal, 2>> gaps = {
      {kDenormal, 2 * kDenormal}, {0, kDenormal},   {-kDenormal, 0},
      {-kDenormal, kDenormal},    {1, 1 + epsilon}, {-1 - epsilon, -1},
      {kLargest / 2, kLargest}};
  if (sizeof(dReal) == sizeof(double)) {
    for (const double low : {1e-320, 1e-310, 1e-50, 1e-20, 1.0, 1e30, 1e39, 1e300}) {
      const dReal near = static_cast<dReal>(low), far = static_cast<dReal>(low * (1 + 1e-3));
      gaps.push_back({near, far});
      gaps.push_back({-far, -near});
    }
  }
  for (const Configuration& configuration : configurations()) {
    for (const auto& [low, high] : gaps) {
      const Space space(configuration);
      World world(space);
      REQUIRE(low < high);
      for (int axis = 0; axis < 3; ++axis) {
        Bounds below = {0, 1, 0, 1, 0, 1}, above = below;
        below[2 * axis] = -kLargest;
        below[2 * axis + 1] = low;
        above[2 * axis] = high;
        above[2 * axis + 1] = kLargest;
        world.take(createUserBox(space, below));
        world.take(createUserBox(space, above));
      }
      // Enough of them to pass by whatever serves the smallest scenes.
      for (int i = 0; i < 20; ++i) world.take(createUserBox(space, {5, 6, 5, 6, 5, 6}));
      INFO(configuration.name << ", between " << low << " and " << high);
      CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
    }
  }
}

TEST_CASE("A program's flushing of denormals and its rounding change no pair", "[bounds]") {
  if (!FloatingPointMode::kCanBeSet) WARN("SKIPPED: modes cannot be set here, only the usual one");
  const unsigned modes[] = {FloatingPointMode::kFlushing, FloatingPointMode::kDownward,
                            FloatingPointMode::kUpward, FloatingPointMode::kTowardZero};
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {8, 100, 3000}) {
      const Space space(configuration);
      dParallelSAPSpaceSetNumThreads(space, 3);
      World world(space);
      Random random(seedOr(90));
      for (std::size_t i = 0; i < n / 2; ++i) {
        world.take(createUserBox(space, extremeBounds(random, true)));
        world.take(createUserBox(space, {static_cast<dReal>(random.unit()), 1, 0, 1,
                                         static_cast<dReal>(-random.unit()), 0}));
      }
      const Pairs expected = expectedPairs(world.geoms());
      for (const unsigned mode : modes) {
        Pairs got;
        unsigned after;
        {
          const FloatingPointMode scoped(mode);
          got = collide(space);
          after = FloatingPointMode::current();
        }
        INFO(configuration.name << ", " << n << " geoms, mode " << std::hex << mode);
        REQUIRE(difference(got, expected) == "");
        REQUIRE(after == mode);
      }
    }
  }
}

TEST_CASE("Extreme bounds among ordinary ones follow the formula and harm nobody", "[bounds]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {50, 1000, 4000}) {
      const std::uint64_t seed = seedOr(70 + n);
      Random random(seed);
      const Space space(configuration);
      World world(space);
      for (const Box& box : denseCube(n, seed)) {
        if (random.chance(0.01)) {
          world.take(createUserBox(space, extremeBounds(random, true)));
        } else {
          world.addBox(box);
        }
      }
      INFO(configuration.name << ", " << n << " geoms, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
      // The extremes change places with ordinary bounds from frame to frame.
      for (int frame = 0; frame < 3; ++frame) {
        for (const dGeomID geom : world.geoms()) {
          if (!isUserBox(geom)) continue;
          setUserBounds(
              geom, random.chance(0.5) ? extremeBounds(random, true) : Bounds{1, 2, 1, 2, 1, 2});
        }
        REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
      }
    }
  }
}

TEST_CASE("An inverted box pairs with what spans its gap, as the formula has it", "[bounds]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.take(createUserBox(space, {2, 1, 0, 1, 0, 1}));
    world.take(createUserBox(space, {0, 3, 0, 1, 0, 1}));           // spans
    world.take(createUserBox(space, {0, dReal(1.5), 0, 1, 0, 1}));  // does not
    world.take(createUserBox(space, {1, 2, 0, 1, 0, 1}));           // just does
    world.take(createUserBox(space, {2, 1, 0, 1, 0, 1}));           // inverted too
    world.take(createUserBox(space, {kInfinity, -kInfinity, 0, 1, 0, 1}));
    world.take(createUserBox(space, {-kInfinity, kInfinity, 0, 1, 0, 1}));
    const Pairs expected = {{0, 1}, {0, 3}, {0, 6}, {1, 2}, {1, 3}, {1, 4}, {1, 6},
                            {2, 3}, {2, 6}, {3, 4}, {3, 6}, {4, 6}, {5, 6}};
    INFO(configuration.name);
    CHECK(difference(collide(space), expected) == "");
    // Among others, far from where all-pairs tests would be used.
    world.addBoxes(denseCube(1500, 12));
    CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
  }
}
