// Time and memory follow geoms and pairs at any scale of coordinates, not only the pairs
// themselves.
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

Bounds scaled(const Box& box, double scale) {
  Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    bounds[2 * axis] = static_cast<dReal>(box.low[axis] * scale);
    bounds[2 * axis + 1] = static_cast<dReal>(box.high[axis] * scale);
  }
  return bounds;
}

// Pairs that the extraction found, whatever the exact test made of them.
unsigned long long candidates(dSpaceID space) {
  return statsOf(space).candidates;
}

}  // namespace

TEST_CASE("No scale of the coordinates makes candidates of boxes that are apart") {
  const std::uint64_t seed = seedOr(11);
  INFO("seed " << seed);
  const bool is_double = sizeof(dReal) == sizeof(double);
  for (const double scale :
       {1.0, 1e-3, 1e-30, 1e6, 1e30, 1e-39, 1e-60, 1e-300, 1e39, 1e60, 1e300}) {
    if (!is_double && (scale < 1e-30 || scale > 1e30)) continue;
    for (const Configuration& configuration : configurations()) {
      INFO(configuration.name << ", scale " << scale);
      const Space space(configuration);
      World world(space);
      for (const Box& box : denseCube(1500, seed))
        world.take(createUserBox(space, scaled(box, scale)));
      const Pairs pairs = collide(space);
      CHECK(difference(pairs, expectedPairs(world.geoms())) == "");
      CHECK(candidates(space) <= pairs.size() + 100);
    }
  }
}

TEST_CASE("Some boxes far away do not make candidates of each other") {
  const std::uint64_t seed = seedOr(12);
  INFO("seed " << seed);
  for (const Configuration& configuration : configurations()) {
    INFO(configuration.name);
    const Space space(configuration);
    World world(space);
    std::size_t i = 0;
    for (const Box& box : denseCube(6000, seed)) {
      Bounds bounds = scaled(box, 1);
      if (i++ % 20 == 0)
        for (dReal& bound : bounds) bound += sizeof(dReal) == sizeof(double) ? 1e9 : 0;
      world.take(createUserBox(space, bounds));
    }
    const Pairs pairs = collide(space);
    CHECK(difference(pairs, expectedPairs(world.geoms())) == "");
    CHECK(candidates(space) <= pairs.size() + 100);
  }
}

TEST_CASE("Small boxes far away that gather from one frame to the next are no candidates at once") {
  const std::uint64_t seed = seedOr(13);
  INFO("seed " << seed);
  constexpr double far = sizeof(dReal) == sizeof(double) ? 1e6 : 0, apart = 1e5, together = 0.05;
  for (const Configuration& configuration : configurations()) {
    Random random(seed);
    const Space space(configuration);
    World world(space);
    for (int i = 0; i < 5000; ++i)
      world.take(dCreateBox(space, dReal(0.001), dReal(0.001), dReal(0.001)));
    for (int frame = 0; frame < 6; ++frame) {
      INFO(configuration.name << ", frame " << frame);
      const double spread = frame < 3 ? apart : together;
      const auto place = [&] { return static_cast<dReal>(far + random.between(0, spread)); };
      for (const dGeomID geom : world.geoms()) dGeomSetPosition(geom, place(), place(), place());
      const Pairs pairs = collide(space);
      CHECK(difference(pairs, expectedPairs(world.geoms())) == "");
      CHECK(pairs.size() >= (frame < 3 ? 0 : 500));
      CHECK(candidates(space) <= pairs.size() + 100);
    }
  }
}

TEST_CASE("Geoms that come and go leave no slots behind in a space that only meets others") {
  const Space space;
  World world(space);
  for (int i = 0; i < 10; ++i) world.take(createUserBox(space, {0, 1, 0, 1, 0, 1}));
  const dGeomID probe = dCreateSphere(0, 1);
  const auto held = [&] {
    collide(space);
    return statsOf(space).memory_bytes;
  };
  const std::size_t before = held();
  for (int i = 0; i < 100000; ++i) {
    const dGeomID geom = dSpaceGetGeom(space, 0);
    dSpaceRemove(space, geom);
    dSpaceAdd(space, geom);
    if (i % 1000 == 0) REQUIRE(collide2(space, probe).size() == 10);
  }
  CHECK(held() <= before + 4096);
  dGeomDestroy(probe);
}
