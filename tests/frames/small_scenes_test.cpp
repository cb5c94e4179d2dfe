// Small spaces whose frames have nothing to see to but their geoms: whatever else comes up must be
// seen all the same.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdio>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/floating_point.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

// Frames in which all geoms move, or none.
void run(World& world, int frames, bool moving, std::uint64_t seed) {
  for (int frame = 0; frame < frames; ++frame) {
    if (moving) world.jitter(0.1, seed + static_cast<std::uint64_t>(frame));
    REQUIRE(difference(collide(world.space()), expectedPairs(world.geoms())) == "");
  }
}

struct Again {
  Pairs pairs;
  dSpaceID space;
  dGeomID disabled;
};

// Records the pair; the first time also disables a geom, and collides the space again.
void recordAndCollide(void* data, dGeomID a, dGeomID b) {
  Again& again = *static_cast<Again*>(data);
  again.pairs.push_back({number(a), number(b)});
  if (again.pairs.size() > 1) return;
  dGeomDisable(again.disabled);
  for (int frame = 0; frame < 3; ++frame) (void)collide(again.space);
}

// An AABB function that leaves the thread in a mode that flushes denormals.
std::optional<FloatingPointMode> flushing;
void boundsAndFlush(dGeomID geom, dReal aabb[6]) {
  constexpr dReal least = std::numeric_limits<dReal>::denorm_min();
  const dReal begin = number(geom) ? least : -1, end = number(geom) ? 1 : 0;
  for (int axis = 0; axis < 3; ++axis) {
    aabb[2 * axis] = begin;
    aabb[2 * axis + 1] = end;
  }
  flushing.emplace(FloatingPointMode::kFlushing);
}

dGeomID createFlushing(dSpaceID space, std::size_t which) {
  static const int type = [] {
    dGeomClass c = {};
    c.collider = [](int) -> dColliderFn* { return nullptr; };
    c.aabb = boundsAndFlush;
    return dCreateGeomClass(&c);
  }();
  const dGeomID geom = dCreateGeom(type);
  setNumber(geom, which);
  dSpaceAdd(space, geom);
  return geom;
}

}  // namespace

TEST_CASE("What is done to a small space between two frames is seen by the next one", "[small]") {
  using Action = void (*)(World & world, dSpaceID space);
  const std::string path = "small_scenes.trace";
  const std::pair<const char*, Action> actions[] = {
      {"nothing", [](World&, dSpaceID) {}},
      {"method",
       [](World& world, dSpaceID space) {
         REQUIRE(dParallelSAPSpaceSetMethod(space, dParallelSAPMethodSweep));
         run(world, 1, true, 1);
         CHECK(statsOf(space).method == dParallelSAPMethodSweep);
       }},
      {"static pairs left out",
       [](World& world, dSpaceID space) {
         dParallelSAPSpaceSetSkipStatic(space, 1);
         CHECK(collide(space).empty());
         world.jitter(0.1, 2);
         CHECK(collide(space).empty());
         dParallelSAPSpaceSetSkipStatic(space, 0);
       }},
      {"static pairs left out since it was not small",
       [](World&, dSpaceID space) {
         REQUIRE(dParallelSAPSpaceSetMethod(space, dParallelSAPMethodSweep));
         dParallelSAPSpaceSetSkipStatic(space, 1);
         CHECK(collide(space).empty());
         REQUIRE(dParallelSAPSpaceSetMethod(space, dParallelSAPMethodAuto));
         CHECK(collide(space).empty());
         CHECK(collide(space).empty());
         dParallelSAPSpaceSetSkipStatic(space, 0);
       }},
      {"events",
       [](World& world, dSpaceID space) {
         dParallelSAPSpaceSetEvents(space, 1);
         run(world, 1, true, 3);
         const dParallelSAPPairEvent* begun;
         CHECK(dParallelSAPSpaceGetBegunPairs(space, &begun) ==
               expectedPairs(world.geoms()).size());
       }},
      {"trace",
       [](World& world, dSpaceID space) {
         REQUIRE(dParallelSAPSpaceSetTrace(space, "small_scenes.trace", 1));
         run(world, 1, true, 4);
         dParallelSAPSpaceSetTrace(space, nullptr, 1);
         CHECK(std::ifstream("small_scenes.trace", std::ios::ate).tellg() > 100);
       }},
      {"statistics",
       [](World& world, dSpaceID space) {
         (void)statsOf(space);
         run(world, 1, true, 5);
         CHECK(statsOf(space).total_ms > 0);
       }},
      {"one disabled",
       [](World& world, dSpaceID space) {
         dGeomDisable(world.geoms()[1]);
         run(world, 1, true, 6);
         CHECK(statsOf(space).disabled == 1);
       }},
      {"one without bits",
       [](World& world, dSpaceID) {
         dGeomSetCategoryBits(world.geoms()[1], 0);
         dGeomSetCollideBits(world.geoms()[1], 0);
       }},
      {"one removed and added again",
       [](World& world, dSpaceID) {
         const dGeomID geom = world.geoms()[0];
         world.remove(geom);
         run(world, 1, true, 7);
         world.addAgain(geom);
       }},
      {"an unbounded one",
       [](World& world, dSpaceID space) {
         world.take(dCreatePlane(space, 0, 0, 1, 0));
         run(world, 2, true, 8);
         CHECK(statsOf(space).unbounded == 1);
       }},
      {"a user class's",
       [](World& world, dSpaceID space) {
         const Bounds bounds = {0, 1, 0, 1, 0, 1};
         world.take(
             createUserBox(space, bounds, false, [](dGeomID, dGeomID, dReal*) { return 0; }));
       }},
      {"so many that it is small no more",
       [](World& world, dSpaceID) { world.addBoxes(denseCube(150, 9)); }},
      {"a query",
       [](World& world, dSpaceID space) {
         (void)collide2(space, world.geoms()[0]);
         world.addBoxes(denseCube(150, 10));
       }},
      {"cleaned",
       [](World& world, dSpaceID space) {
         world.jitter(0.1, 11);
         dSpaceClean(space);
       }},
  };
  for (const auto& action : actions)
    for (const std::size_t n : {2, 3, 4, 7, 32, 33, 40})
      for (const bool moving : {false, true}) {
        INFO(action.first << ", " << n << " geoms, moving " << moving);
        const Space space;
        World world(space);
        world.addBoxes(denseCube(n, 12));
        run(world, 5, moving, 13);
        action.second(world, space);
        run(world, 3, false, 14);
        run(world, 3, true, 15);
        run(world, 3, false, 16);
      }
  std::remove(path.c_str());
}

TEST_CASE("A small frame's statistics are its own after a collide within its callback", "[small]") {
  for (const bool moving : {false, true}) {
    INFO("moving " << moving);
    const Space space;
    World world(space);
    world.addBoxes(denseCube(12, 17));
    run(world, 5, moving, 18);
    if (moving) world.jitter(0.1, 19);
    Again again = {{}, space, world.geoms()[5]};
    dSpaceCollide(space, &again, recordAndCollide);
    const dParallelSAPStats stats = statsOf(space);
    dGeomEnable(world.geoms()[5]);
    // The pairs are those of the moment when it began.
    CHECK(difference(again.pairs, expectedPairs(world.geoms())) == "");
    CHECK(stats.pairs == again.pairs.size());
    CHECK(stats.disabled == 0);
    CHECK(stats.moved == (moving ? 12 : 0));
    CHECK(stats.frames == 9);
    run(world, 3, moving, 20);
  }
}

TEST_CASE("A small space whose callback throws is unlocked and goes on", "[small]") {
  const Space space;
  World world(space);
  world.addBoxes(denseCube(8, 21));
  for (const bool moving : {false, true}) {
    run(world, 5, moving, 22);
    if (moving) world.jitter(0.1, 23);
    const Pairs told = collideUntil(space, 2);
    Pairs all = expectedPairs(world.geoms());
    REQUIRE(all.size() > 2);
    all.resize(2);
    CHECK(difference(told, all) == "");
    world.addBoxes(denseCube(1, 24));
    run(world, 3, moving, 25);
  }
}

TEST_CASE("A small space reports a NaN that comes later once, and counts it in every frame",
          "[small]") {
  const Space space;
  World world(space);
  world.addBoxes(denseCube(5, 26));
  run(world, 5, true, 27);
  const Messages messages;
  dGeomSetPosition(world.geoms()[2], std::numeric_limits<dReal>::quiet_NaN(), 0, 0);
  for (int frame = 0; frame < 5; ++frame) {
    REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
    CHECK(statsOf(space).invalid == 1);
  }
  CHECK(messages.all().size() == 1);
}

TEST_CASE("A signalling NaN traps in no small frame of a program whose invalid operations do",
          "[small]") {
  if (!FloatingPointMode::kCanBeSet) return;
  const Space space;
  const dGeomID geoms[] = {createUserBox(space, {0, 1, 0, 1, 0, 1}),
                           createUserBox(space, {0, 1, 0, 1, 0, 1}),
                           createUserBox(space, {0, 1, 0, 1, 0, 1})};
  const Messages messages;
  for (int frame = 0; frame < 3; ++frame) {
    Bounds bounds{0, 1, 0, 1, 0, 1};
    if (frame > 0) bounds[frame] = std::numeric_limits<dReal>::signaling_NaN();
    setUserBounds(geoms[1], bounds);
    const Pairs pairs = [&] {
      const FloatingPointMode trapping(FloatingPointMode::kTrapping);
      return collide(space);
    }();
    CHECK(pairs.size() == (frame > 0 ? 1u : 3u));
  }
  CHECK(messages.all().size() == 1);
}

TEST_CASE("A mode that an AABB function leaves behind changes no pair of a small space",
          "[small]") {
  if (!FloatingPointMode::kCanBeSet) return;
  const Space space;
  const dGeomID geoms[] = {createFlushing(space, 0), createFlushing(space, 1)};
  for (int frame = 0; frame < 5; ++frame) {
    const FloatingPointMode usual(FloatingPointMode::kDefault);
    for (const dGeomID geom : geoms) dGeomSetPosition(geom, 0, 0, 0);
    CHECK(collide(space).empty());
    CHECK(FloatingPointMode::current() == FloatingPointMode::kFlushing);
    flushing.reset();
  }
}
