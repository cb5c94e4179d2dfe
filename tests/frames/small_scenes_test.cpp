// Small spaces whose frames have nothing to see to but their geoms: whatever else comes up must be
// seen all the same.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <utility>

#include "support/catch.hpp"
#include "support/configurations.h"
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
