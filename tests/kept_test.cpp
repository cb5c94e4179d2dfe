// Frames in which little changes: what is kept from the frame before must not show.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

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

enum Skip { kNothing, kStatic, kAsleep, kBoth };

// Which pairs the settings leave out, in the words of the header.
bool leftOut(dGeomID a, dGeomID b, Skip skip) {
  const dBodyID bodies[] = {dGeomGetBody(a), dGeomGetBody(b)};
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) return false;
  if (!bodies[0] && !bodies[1]) return skip == kStatic || skip == kBoth;
  if (skip != kAsleep && skip != kBoth) return false;
  for (const dBodyID body : bodies)
    if (body && dBodyIsEnabled(body)) return false;
  return true;
}

class Scene {
 public:
  Scene(const Configuration& configuration, std::size_t n, std::uint64_t seed)
      : space_(configuration), world_(space_), random_(seed) {
    world_.addBoxes(denseCube(n, seed));
    for (const dGeomID geom : world_.geoms()) {
      order_.push_back(geom);
      if (random_.chance(0.7)) world_.giveBody(geom);
    }
    reach_ = std::cbrt(static_cast<double>(n));
  }

  dSpaceID space() const { return space_; }

  // Moves about `part` of the geoms and changes some without a word to the space.
  void change(double part) {
    const std::size_t moves = static_cast<std::size_t>(part * order_.size() + random_.unit());
    for (std::size_t i = 0; i < moves; ++i) move(any());
    if (part == 0 && random_.chance(0.7)) return;
    for (int i = 0; i < 3; ++i) changeSilently(any());
    if (random_.chance(0.3)) reAdd();
    if (random_.chance(0.2)) dSpaceClean(space_);
    if (random_.chance(0.2)) (void)collide2(space_, any());
  }

  Pairs expected(Skip skip) const {
    Pairs pairs;
    for (const Pair& pair : expectedPairs(order_))
      if (!leftOut(world_.geoms()[pair.first], world_.geoms()[pair.second], skip))
        pairs.push_back(pair);
    return pairs;
  }

  // The distance between the boxes of two geoms on the axis on which it is greatest.
  dReal gap(const Pair& pair) const {
    dReal a[6], b[6], gap = 0;
    dGeomGetAABB(world_.geoms()[pair.first], a);
    dGeomGetAABB(world_.geoms()[pair.second], b);
    for (int axis = 0; axis < 3; ++axis)
      gap = std::max({gap, a[2 * axis] - b[2 * axis + 1], b[2 * axis] - a[2 * axis + 1]});
    return gap;
  }
  void drift(double distance) {
    for (const dGeomID geom : order_) shift(geom, distance);
  }
  std::size_t size() const { return order_.size(); }

 private:
  dGeomID any() { return order_[random_.below(order_.size())]; }

  void move(dGeomID geom) {
    if (random_.chance(0.1))
      dGeomSetPosition(geom, random_.between(0, reach_), random_.between(0, reach_),
                       random_.between(0, reach_));
    else
      shift(geom, 0.3);
  }
  void shift(dGeomID geom, double distance) {
    const dReal* const place = dGeomGetPosition(geom);
    const dReal x = place[0], y = place[1], z = place[2];
    dGeomSetPosition(geom, x + random_.between(-distance, distance),
                     y + random_.between(-distance, distance),
                     z + random_.between(-distance, distance));
  }
  void changeSilently(dGeomID geom) {
    const dBodyID body = dGeomGetBody(geom);
    switch (random_.below(7)) {
      case 0:
        dGeomIsEnabled(geom) ? dGeomDisable(geom) : dGeomEnable(geom);
        break;
      case 1:
        dGeomSetCategoryBits(geom, random_.chance(0.5) ? ~0ul : 1ul << random_.below(3));
        break;
      case 2:
        dGeomSetCollideBits(geom, random_.chance(0.5) ? ~0ul : random_.below(8));
        break;
      case 3:
        dGeomSetBody(geom, nullptr);
        break;
      case 4:
        dGeomSetBody(geom, dGeomGetBody(any()));
        break;
      case 5:
        if (body) dBodyDisable(body);
        break;
      case 6:
        if (body) dBodyEnable(body);
        break;
    }
  }
  void reAdd() {
    const std::size_t i = random_.below(order_.size());
    const dGeomID geom = order_[i];
    dSpaceRemove(space_, geom);
    if (random_.chance(0.5)) (void)collide(space_);
    dSpaceAdd(space_, geom);
    order_.erase(order_.begin() + i);
    order_.push_back(geom);
  }

  Space space_;
  World world_;
  Random random_;
  std::vector<dGeomID> order_;
  double reach_;
};

}  // namespace

TEST_CASE("Whatever share of a scene changes, the pairs are those of the formula", "[kept]") {
  const std::uint64_t seed = seedOr(61);
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {12, 60, 300, 900}) {
      Scene scene(configuration, n, seed);
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
        Scene scene(configuration, n, seed);
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

TEST_CASE("A tolerance lets near pairs through, and none is missed", "[kept]") {
  const std::uint64_t seed = seedOr(63);
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {30, 900})
      for (const double tolerance : {1e-9, 0.01, 0.2, 2.0}) {
        Scene scene(configuration, n, seed);
        dParallelSAPSpaceSetTolerance(scene.space(), tolerance);
        for (int frame = 0; frame < scaled(25); ++frame) {
          INFO(configuration.name << ", seed " << seed << ", " << n << " geoms, tolerance "
                                  << tolerance << ", frame " << frame);
          const Pairs pairs = collide(scene.space());
          const Pairs exact = scene.expected(kNothing);
          const std::set<Pair> reported(pairs.begin(), pairs.end());
          REQUIRE(reported.size() == pairs.size());
          std::size_t missed = 0, too_far = 0;
          for (const Pair& pair : exact) missed += reported.count(pair) == 0;
          for (const Pair& pair : pairs) too_far += scene.gap(pair) > tolerance;
          REQUIRE(missed == 0);
          REQUIRE(too_far == 0);
          if (frame % 5 == 4)
            scene.change(0.01);
          else
            scene.drift(tolerance / 16);
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

TEST_CASE("With a tolerance, small steps cost no search", "[kept]") {
  Space space;
  World world(space);
  world.addBoxes(denseCube(3000, 65));
  dParallelSAPSpaceSetTolerance(space, 0.4);
  const Pairs pairs = collide(space);
  world.jitter(0.02, 1);
  CHECK(difference(collide(space), pairs) == "");
  dParallelSAPStats stats;
  dParallelSAPSpaceGetStats(space, &stats);
  CHECK(stats.moved == 3000);
  CHECK(stats.kept == pairs.size());
  world.jitter(2, 2);
  (void)collide(space);
  dParallelSAPSpaceGetStats(space, &stats);
  CHECK(stats.moved == 3000);
  CHECK(stats.kept == 0);
}

TEST_CASE("A tolerance that all geoms exceed is left out for more and more frames",
          "[kept][long]") {
  Space space;
  World world(space);
  world.addBoxes(denseCube(3000, 66));
  constexpr double tolerance = 0.05;
  dParallelSAPSpaceSetTolerance(space, tolerance);
  std::vector<int> tries;  // frames that report more than the exact pairs
  for (int frame = 0; frame < 100; ++frame) {
    INFO("frame " << frame);
    world.jitter(0.4, frame);
    const Pairs pairs = collide(space), exact = expectedPairs(world.geoms());
    const std::set<Pair> reported(pairs.begin(), pairs.end());
    for (const Pair& pair : exact) REQUIRE(reported.count(pair) == 1);
    if (pairs.size() > exact.size()) tries.push_back(frame);
  }
  REQUIRE(tries.size() >= 4);
  CHECK(tries.size() < 20);
  CHECK(tries.back() > 60);
  // Another one is tried at once.
  dParallelSAPSpaceSetTolerance(space, 2 * tolerance);
  CHECK(collide(space).size() > expectedPairs(world.geoms()).size());
}

TEST_CASE("A tolerance helps again soon once a scene has calmed down", "[kept][long]") {
  // The same for one thread and two, in every frame.
  Space spaces[2];
  World one(spaces[0]), two(spaces[1]);
  World* const worlds[] = {&one, &two};
  for (int i = 0; i < 2; ++i) {
    worlds[i]->addBoxes(denseCube(3000, 67));
    dParallelSAPSpaceSetTolerance(spaces[i], 0.1);
    dParallelSAPSpaceSetNumThreads(spaces[i], i + 1);
  }
  int kept = 0;
  for (int frame = 0; frame < 500; ++frame) {
    INFO("frame " << frame);
    const double distance = frame < 300 ? 0.5 : 0.0005;
    for (World* const world : worlds) world->jitter(distance, frame);
    const Pairs pairs = collide(spaces[0]);
    REQUIRE(pairs == collide(spaces[1]));
    // All stay where they are by the tolerance alone.
    if (frame >= 400 && pairs.size() > expectedPairs(one.geoms()).size()) ++kept;
  }
  CHECK(kept > 90);
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

TEST_CASE("A geom within the tolerance of what its slot held is looked at if it is another",
          "[kept]") {
  Space space;
  World world(space);
  world.addBoxes(denseCube(1000, 68));
  dParallelSAPSpaceSetTolerance(space, 0.1);
  dParallelSAPSpaceSetSkipStatic(space, 1);
  dParallelSAPSpaceSetSkipAsleep(space, 1);
  const dGeomID geom = world.geoms()[500];
  CHECK(collide(space).empty());
  const dWorldID bodies = dWorldCreate();
  const dBodyID body = dBodyCreate(bodies);
  const dReal* const place = dGeomGetPosition(geom);
  dBodySetPosition(body, place[0], place[1], place[2]);
  dBodyDisable(body);
  dGeomSetBody(geom, body);
  CHECK(collide(space).empty());
  dBodyEnable(body);
  CHECK(collide(space).size() > 0);

  // The last slot: a box, then one of a user class that may touch nothing.
  dParallelSAPSpaceSetSkipStatic(space, 0);
  const dGeomID box = dCreateBox(space, 3, 3, 3);
  dGeomSetPosition(box, 5, 5, 5);
  setNumber(box, 1000);
  const auto ofLast = [&] {
    const Pairs pairs = collide(space);
    return std::count_if(pairs.begin(), pairs.end(), [](Pair p) { return p.second == 1000; });
  };
  CHECK(ofLast() > 0);
  CHECK(ofLast() > 0);
  dGeomDestroy(box);
  const dGeomID user = createUserBox(space, {3.5, 6.5, 3.5, 6.5, 3.5, 6.5}, false,
                                     [](dGeomID, dGeomID, dReal*) { return 0; });
  setNumber(user, 1000);
  CHECK(ofLast() == 0);
  dGeomDestroy(user);
  dGeomSetBody(geom, nullptr);
  dWorldDestroy(bodies);
}

TEST_CASE("A culled plane's pairs are exact within a tolerance too", "[kept]") {
  Space space;
  World world(space);
  world.addBoxes(denseCube(300, 69));
  const dGeomID plane = dCreatePlane(space, 1, 1, 0, -0.1);
  setNumber(plane, 300);
  dGeomSetPosition(world.geoms()[0], 0.5, 0.5, 0);
  dParallelSAPSpaceSetCullPlanes(space, 1);
  const auto ofPlane = [&] {
    const Pairs pairs = collide(space);
    return std::count_if(pairs.begin(), pairs.end(), [](Pair p) { return p.second == 300; });
  };
  const auto exact = ofPlane();
  dParallelSAPSpaceSetTolerance(space, 1);
  CHECK(ofPlane() == exact);
  CHECK(ofPlane() == exact);
}
