// Time and memory follow geoms and pairs at any scale of coordinates, not only the pairs
// themselves.
#include <cstddef>

#include "support/rules_oracle.h"
#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr bool kIsDouble = sizeof(dReal) == sizeof(double);

// The pairs, and hardly more that only the exact test left out.
Pairs collideWithoutCandidates(const Space& space, const World& world) {
  const Pairs pairs = collide(space);
  CHECK(difference(pairs, expectedPairs(world.geoms())) == "");
  CHECK(statsOf(space).candidates <= pairs.size() + 100);
  return pairs;
}

int framesWithKeptCandidates(World& world) {
  int kept = 0;
  for (int frame = 0; frame < 20; ++frame) {
    world.jitter(0.001, 100 + static_cast<std::uint64_t>(frame));
    (void)collide(world.space());
    kept += statsOf(world.space()).candidates_kept > 0;
  }
  return kept;
}

}  // namespace

TEST_CASE("No scale of the coordinates makes candidates of boxes that are apart", "[scale]") {
  const std::uint64_t seed = seedOr(11);
  INFO("seed " << seed);
  for (const double scale :
       {1.0, 1e-3, 1e-30, 1e6, 1e30, 1e-39, 1e-60, 1e-300, 1e39, 1e60, 1e300}) {
    if (!kIsDouble && (scale < 1e-30 || scale > 1e30)) continue;
    for (const Configuration& configuration : configurations()) {
      INFO(configuration.name << ", scale " << scale);
      const Space space(configuration);
      World world(space);
      for (const Box& box : denseCube(1500, seed)) {
        Bounds bounds;
        for (std::size_t i = 0; i < 6; ++i)
          bounds[i] = real((i % 2 ? box.high : box.low)[i / 2] * scale);
        world.take(createUserBox(space, bounds));
      }
      collideWithoutCandidates(space, world);
    }
  }
}

TEST_CASE("Boxes far away do not make candidates of each other", "[scale]") {
  const std::uint64_t seed = seedOr(12);
  INFO("seed " << seed);
  for (const Configuration& configuration : configurations())
    for (const std::size_t every : {1, 2, 20}) {  // how many are far away
      INFO(configuration.name << ", every " << every);
      const Space space(configuration);
      World world(space, denseCube(6000, seed));
      for (std::size_t i = 0; kIsDouble && i < world.geoms().size(); i += every)
        moveBy(world.geoms()[i], 1e9, 0, 1e9);
      collideWithoutCandidates(space, world);
    }
}

TEST_CASE("Small boxes far away that gather from one frame to the next are no candidates at once",
          "[scale]") {
  const std::uint64_t seed = seedOr(13);
  INFO("seed " << seed);
  constexpr double far = kIsDouble ? 1e6 : 0, apart = 1e5, together = 0.05;
  for (const Configuration& configuration : configurations()) {
    Random random(seed);
    const Space space(configuration);
    World world(space);
    for (int i = 0; i < 5000; ++i)
      world.take(dCreateBox(space, dReal(0.001), dReal(0.001), dReal(0.001)));
    for (int frame = 0; frame < 6; ++frame) {
      INFO(configuration.name << ", frame " << frame);
      const double spread = frame < 3 ? apart : together;
      const auto place = [&] { return real(far + random.between(0, spread)); };
      for (const dGeomID geom : world.geoms()) dGeomSetPosition(geom, place(), place(), place());
      CHECK(collideWithoutCandidates(space, world).size() >= (frame < 3 ? 0 : 500));
    }
  }
}

TEST_CASE("Geoms that have fallen out of the scene one by one do not slow the others down",
          "[scale]") {
  const Space space(on_cpu);
  World world(space, denseCube(3000, 80));
  for (std::size_t i = 0; i < 200; ++i)
    dGeomSetPosition(world.geoms()[i * 15], 1, 2, -1e9 - dReal(1e6) * dReal(i));
  CHECK(framesWithKeptCandidates(world) > 10);
}

TEST_CASE("Geoms that come and go in each frame do not slow the others down", "[scale]") {
  // A sample of a sixteenth, and one of no more than are sampled.
  for (const std::size_t boxes : {800, 3000}) {
    const Space space(on_cpu);
    World world(space, denseCube(2 * boxes, 83));
    std::vector<dGeomID> outside;
    while (outside.size() < boxes) {
      outside.push_back(world.geoms().back());
      world.remove(outside.back());
    }
    int kept = 0;
    for (std::size_t frame = 0; frame < 40; ++frame) {
      world.jitter(0.001, 200 + frame);
      for (std::size_t i = 0; i < 2 + frame % 2; ++i) {
        world.addAgain(outside.back());
        outside.pop_back();
      }
      for (int i = 0; i < 2; ++i) {
        outside.insert(outside.begin(), world.geoms()[frame * 7]);
        world.remove(outside.front());
      }
      CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
      kept += statsOf(space).candidates_kept > 0;
    }
    CHECK(kept > 20);
  }
}

TEST_CASE("A tolerance that floats cannot tell at one geom's place has no effect until it is back",
          "[scale]") {
  const Space space(on_cpu);
  World world(space, denseCube(3000, 82));
  dParallelSAPSpaceSetTolerance(space, dReal(0.1));
  const auto extraPairs = [&](std::uint64_t seed) {
    world.jitter(0.001, seed);
    const Pairs pairs = collide(space);
    CHECK(wrongByRules(Rules::of(space), world.geoms(), pairs) == "");
    return pairs.size() - expectedPairs(world.geoms()).size();
  };
  CHECK(extraPairs(1) > 0);
  dGeomSetPosition(world.geoms()[7], 1e5, 0, 0);
  CHECK(extraPairs(2) == 0);
  CHECK(framesWithKeptCandidates(world) > 10);
  dGeomSetPosition(world.geoms()[7], 1, 0, 0);
  CHECK(extraPairs(3) > 0);
}

TEST_CASE("Geoms that come and go leave no slots behind in a space that only meets others",
          "[scale]") {
  const Space space;
  World world(space);
  for (int i = 0; i < 10; ++i) world.take(createUserBox(space, {0, 1, 0, 1, 0, 1}));
  const dGeomID probe = dCreateSphere(nullptr, 1);
  const auto held = [&] {
    (void)collide(space);
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
