// Margins that the user allows: none is missed, and small steps cost no search.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <set>
#include <vector>

#include "support/catch.hpp"
#include "support/changing_scene.h"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

TEST_CASE("A tolerance lets near pairs through, and none is missed", "[tolerance]") {
  const std::uint64_t seed = seedOr(63);
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {30, 900})
      for (const double tolerance : {1e-9, 0.01, 0.2, 2.0}) {
        ChangingScene scene(configuration, n, seed);
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

TEST_CASE("With a tolerance, small steps cost no search", "[tolerance]") {
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

TEST_CASE("A tolerance that all geoms exceed lets near pairs through in every frame",
          "[tolerance]") {
  Space space;
  World world(space);
  world.addBoxes(denseCube(3000, 66));
  dParallelSAPSpaceSetTolerance(space, dReal(0.05));
  for (int frame = 0; frame < 20; ++frame) {
    INFO("frame " << frame);
    world.jitter(0.4, frame);
    const Pairs pairs = collide(space), exact = expectedPairs(world.geoms());
    const std::set<Pair> reported(pairs.begin(), pairs.end());
    for (const Pair& pair : exact) REQUIRE(reported.count(pair) == 1);
    CHECK(pairs.size() > exact.size());
  }
}

TEST_CASE("With a tolerance the pairs are the same whatever the number of threads", "[tolerance]") {
  Space spaces[2];
  World one(spaces[0]), two(spaces[1]);
  World* const worlds[] = {&one, &two};
  for (int i = 0; i < 2; ++i) {
    worlds[i]->addBoxes(denseCube(3000, 67));
    dParallelSAPSpaceSetTolerance(spaces[i], 0.1);
    dParallelSAPSpaceSetNumThreads(spaces[i], i + 1);
  }
  for (int frame = 0; frame < 40; ++frame) {
    INFO("frame " << frame);
    const double distance = frame < 20 ? 0.5 : 0.0005;
    for (World* const world : worlds) world->jitter(distance, frame);
    const Pairs pairs = collide(spaces[0]);
    REQUIRE(pairs == collide(spaces[1]));
    CHECK(pairs.size() > expectedPairs(one.geoms()).size());
  }
}

TEST_CASE("With a tolerance frames that report nothing have the pairs of those that do",
          "[tolerance]") {
  // Told of what changes and asked for events alone, and neither.
  Space spaces[2];
  World told(spaces[0]), untold(spaces[1]);
  World* const worlds[] = {&told, &untold};
  for (int i = 0; i < 2; ++i) {
    worlds[i]->addBoxes(denseCube(600, 68));
    dParallelSAPSpaceSetTolerance(spaces[i], 0.2);
  }
  dParallelSAPSpaceSetNotified(spaces[0], 1);
  for (int frame = 0; frame < 60; ++frame) {
    INFO("frame " << frame);
    for (World* const world : worlds)
      if (frame < 15) world->jitter(2, frame);
    dParallelSAPSpaceCollidePairs(spaces[0], nullptr, 0, nullptr);
    REQUIRE(statsOf(spaces[0]).pairs == collide(spaces[1]).size());
    CHECK(statsOf(spaces[0]).pairs > expectedPairs(told.geoms()).size());
  }
}

TEST_CASE("A geom within the tolerance of what its slot held is looked at if it is another",
          "[tolerance]") {
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

TEST_CASE("A culled plane's pairs are exact within a tolerance too", "[tolerance]") {
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
