// Frames in which little changes: what is kept from the frame before must not show.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <array>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/changing_scene.h"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

TEST_CASE("Whatever share of a scene changes, the pairs are those of the formula", "[kept]") {
  const std::uint64_t seed = seedOr(61);
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {12, 60, 300, 900}) {
      ChangingScene scene(configuration, n, seed);
      Random random(seed);
      for (int frame = 0; frame < scaled(60); ++frame) {
        INFO(configuration.name << ", seed " << seed << ", " << n << " geoms, frame " << frame);
        const Pairs pairs = collide(scene.space());
        REQUIRE(difference(pairs, scene.expected(kNothing)) == "");
        constexpr double parts[] = {0, 0, 0.001, 0.01, 0.01, 0.1, 0.5};
        scene.change(parts[random.below(7)]);
      }
    }
}

TEST_CASE("A small scene that stands still sees what changes without a word", "[kept]") {
  using Change = void (*)(World & world, dSpaceID space);
  const std::pair<const char*, Change> changes[] = {
      {"nothing", [](World&, dSpaceID) {}},
      {"disabled", [](World& world, dSpaceID) { dGeomDisable(world.geoms()[3]); }},
      {"category", [](World& world, dSpaceID) { dGeomSetCategoryBits(world.geoms()[2], 0); }},
      {"collide", [](World& world, dSpaceID) { dGeomSetCollideBits(world.geoms()[3], 0); }},
      {"one body",
       [](World& world, dSpaceID) {
         dGeomSetBody(world.geoms()[3], dGeomGetBody(world.geoms()[4]));
       }},
      {"no body", [](World& world, dSpaceID) { dGeomSetBody(world.geoms()[5], nullptr); }},
      {"moved and cleaned",
       [](World& world, dSpaceID space) {
         dGeomSetPosition(world.geoms()[3], 9, 9, 9);
         dSpaceClean(space);
       }},
      {"moved and asked for",
       [](World& world, dSpaceID space) {
         dGeomSetPosition(world.geoms()[3], 9, 9, 9);
         (void)collide2(space, world.geoms()[4]);
       }},
      {"planes culled", [](World&, dSpaceID space) { dParallelSAPSpaceSetCullPlanes(space, 1); }},
      {"one gone", [](World& world, dSpaceID space) { dSpaceRemove(space, world.geoms()[3]); }},
  };
  for (const auto& change : changes)
    for (const std::size_t n : {7, 20, 40}) {
      INFO(change.first << ", " << n << " geoms");
      const Space space;
      World world(space);
      world.addBoxes(denseCube(n, 69));
      for (const dGeomID geom : world.geoms()) world.giveBody(geom);
      dGeomSetBody(world.geoms()[6], dGeomGetBody(world.geoms()[5]));
      dGeomSetCollideBits(world.geoms()[2], 0);
      dGeomSetCategoryBits(world.geoms()[3], 0);
      for (int frame = 0; frame < 5; ++frame)
        REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
      change.second(world, space);
      std::vector<dGeomID> geoms = world.geoms();
      if (dGeomGetSpace(geoms[3]) != space) geoms.erase(geoms.begin() + 3);
      for (int frame = 0; frame < 5; ++frame)
        REQUIRE(difference(collide(space), expectedPairs(geoms)) == "");
      if (geoms.size() == n) continue;
      dSpaceAdd(space, world.geoms()[3]);
      geoms.push_back(world.geoms()[3]);
      REQUIRE(difference(collide(space), expectedPairs(geoms)) == "");
    }
}

TEST_CASE("Pairs at rest are left out on demand, and come back when one of them wakes", "[kept]") {
  const std::uint64_t seed = seedOr(62);
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {30, 300, 900})
      for (const Skip skip : {kStatic, kAsleep, kBoth}) {
        ChangingScene scene(configuration, n, seed);
        Random random(seed);
        dParallelSAPSpaceSetSkipStatic(scene.space(), skip == kStatic || skip == kBoth);
        dParallelSAPSpaceSetSkipAsleep(scene.space(), skip == kAsleep || skip == kBoth);
        for (int frame = 0; frame < scaled(40); ++frame) {
          INFO(configuration.name << ", seed " << seed << ", " << n << " geoms, skip " << skip
                                  << ", frame " << frame);
          const Pairs pairs = collide(scene.space());
          REQUIRE(difference(pairs, scene.expected(skip)) == "");
          constexpr double parts[] = {0, 0.001, 0.01, 0.1, 0.5};
          scene.change(parts[random.below(5)]);
        }
      }
}

TEST_CASE("Pairs that did not change are kept, and statistics say so", "[kept]") {
  Space space;
  World world(space);
  world.addBoxes(denseCube(3000, 64));
  const Pairs pairs = collide(space);
  dParallelSAPStats stats;
  dParallelSAPSpaceGetStats(space, &stats);
  CHECK(stats.kept == 0);
  CHECK(difference(collide(space), pairs) == "");
  dParallelSAPSpaceGetStats(space, &stats);
  CHECK(stats.kept == pairs.size());
  CHECK(stats.moved == 0);
  dGeomSetPosition(world.geoms()[7], 1e6, 0, 0);
  const Pairs others = collide(space);
  CHECK(difference(others, expectedPairs(world.geoms())) == "");
  dParallelSAPSpaceGetStats(space, &stats);
  CHECK(stats.kept == others.size());
  CHECK(stats.moved == 1);
  for (const dGeomID geom : world.geoms()) dGeomSetPosition(geom, dGeomGetPosition(geom)[0], 0, 0);
  CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
  dParallelSAPSpaceGetStats(space, &stats);
  CHECK(stats.kept == 0);
}

TEST_CASE("Pairs are kept where bits are masked out of all, and right where they are not",
          "[kept]") {
  const unsigned long low[] = {1, 2, 8, 1ul << 31, ~0ul};
  const unsigned long masked[] = {~1ul, ~8ul, ~10ul, 6, ~0ul};
  const unsigned long high[] = {1ul << (8 * sizeof(long) - 1), ~(1ul << 31), ~0ul << 16 << 16, 1,
                                0};
  for (const bool all_bits : {false, true}) {
    const Space space;
    World world(space);
    world.addBoxes(denseCube(2000, 67));
    Random random(seedOr(68));
    const auto change = [&](dGeomID geom) {
      const auto& other = all_bits && random.chance(0.3) ? high : masked;
      dGeomSetCategoryBits(geom, low[random.below(std::size(low))]);
      dGeomSetCollideBits(geom, other[random.below(std::size(other))]);
    };
    for (const dGeomID geom : world.geoms()) change(geom);
    for (int frame = 0; frame < 6; ++frame) {
      REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
      if (frame > 0) CHECK((statsOf(space).kept > 0) == (!all_bits || sizeof(long) == 4));
      for (int i = 0; i < 10; ++i) change(world.geoms()[random.below(2000)]);
    }
  }
}

TEST_CASE("Bits above the lowest 32 that are set or cleared without a word are seen", "[kept]") {
  constexpr std::size_t n = 300;
  const unsigned long upper = 1ul << (8 * sizeof(unsigned long) - 24);
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.addBoxes(denseCube(n, seedOr(66)));
    const auto set = [&](unsigned long more) {
      for (std::size_t i = 0; i < n; ++i) {
        dGeomSetCategoryBits(world.geoms()[i], (i % 2 ? 1 : 2) | (i < 20 && i % 2 ? more : 0));
        dGeomSetCollideBits(world.geoms()[i], (i % 2 ? 1 : 2) | (i < 20 && i % 2 ? 0 : more));
      }
    };
    set(0);
    const Pairs without = expectedPairs(world.geoms());
    for (const unsigned long more : {0ul, upper, 0ul, upper, 0ul}) {
      set(more);
      INFO(configuration.name << ", " << more);
      for (int frame = 0; frame < 2; ++frame)
        REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
      CHECK((collide(space) == without) == (more == 0));
    }
  }
}

TEST_CASE("A callback that throws or collides its own space costs the kept pairs only", "[kept]") {
  Space space;
  World world(space);
  world.addBoxes(denseCube(1000, 66));
  const Pairs pairs = collide(space);
  const auto throws = [](void*, dGeomID, dGeomID) { throw 1; };
  CHECK_THROWS(dSpaceCollide(space, nullptr, throws));
  CHECK(difference(collide(space), pairs) == "");
  static dSpaceID own;
  own = space;
  Pairs nested;
  dSpaceCollide(space, &nested, [](void* data, dGeomID, dGeomID) {
    Pairs& inner = *static_cast<Pairs*>(data);
    if (inner.empty()) inner = collide(own);
  });
  CHECK(difference(nested, pairs) == "");
  CHECK(difference(collide(space), pairs) == "");
}

TEST_CASE("A mesh with new triangles, of which no space is told, is where they are", "[kept]") {
  const std::vector<std::array<double, 9>> triangles = {
      {0, 0, 0, 1, 0, 0, 0, 1, 1}, {50, 0, 0, 51, 0, 0, 50, 1, 1}, {90, 9, 9, 91, 9, 9, 90, 8, 8}};
  const dTriIndex indices[] = {0, 1, 2};
  std::vector<dTriMeshDataID> data;
  for (const std::array<double, 9>& vertices : triangles) {
    data.push_back(dGeomTriMeshDataCreate());
    dGeomTriMeshDataBuildDouble(data.back(), vertices.data(), 3 * sizeof(double), 3, indices, 3,
                                3 * sizeof(dTriIndex));
  }
  {
    Space space;
    World world(space);
    world.addBoxes(denseCube(1000, 67));
    std::vector<dGeomID> geoms = world.geoms();
    geoms.push_back(dCreateTriMesh(space, data[0], nullptr, nullptr, nullptr));
    setNumber(geoms.back(), geoms.size() - 1);
    const auto probed = [&] {
      const dGeomID probe = dCreateBox(nullptr, 200, 200, 200);
      setNumber(probe, geoms.size());
      const std::size_t hits = collide2(space, probe).size();
      dGeomDestroy(probe);
      return hits;
    };
    CHECK(difference(collide(space), expectedPairs(geoms)) == "");
    for (int frame = 0; frame < 12; ++frame) {
      INFO("frame " << frame);
      dGeomTriMeshSetData(geoms.back(), data[frame % 3]);
      // No word of this either: ODE takes the mesh for one that is dirty already.
      dGeomSetPosition(geoms.back(), frame % 5, frame % 7, 0);
      dGeomSetPosition(geoms[frame], 2, 2, 2);
      if (frame % 2) (void)probed();
      const Pairs pairs = collide(space);
      CHECK(difference(pairs, expectedPairs(geoms)) == "");
      CHECK(probed() > 0);
    }
    dGeomDestroy(geoms.back());
  }
  for (const dTriMeshDataID mesh : data) dGeomTriMeshDataDestroy(mesh);
}

TEST_CASE("Geoms that are disabled are counted while their bodies are asleep", "[kept]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {20, 300, 1500}) {
      INFO(configuration.name << ", " << n << " geoms");
      Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n, 69));
      for (const dGeomID geom : world.geoms()) dBodyDisable(world.giveBody(geom));
      dBodyEnable(world.bodies()[0]);
      dParallelSAPSpaceSetSkipAsleep(space, 1);
      const auto disabled = [&] {
        (void)collide(space);
        return statsOf(space).disabled;
      };
      for (int frame = 0; frame < 3; ++frame) CHECK(disabled() == 0);
      dGeomDisable(world.geoms()[1]);
      dGeomDisable(world.geoms()[2]);
      for (int frame = 0; frame < 3; ++frame) CHECK(disabled() == 2);
      dBodyEnable(world.bodies()[1]);
      CHECK(disabled() == 2);
      dGeomEnable(world.geoms()[1]);
      dGeomEnable(world.geoms()[2]);
      CHECK(disabled() == 0);
    }
}
