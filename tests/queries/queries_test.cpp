// dSpaceCollide2 of geoms against a space: what random calls (fuzz) do not reach.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <chrono>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

TEST_CASE("A thousand probes of a large space take a small part of dSimpleSpace's time",
          "[queries]") {
  const std::size_t n = 32000;
  const Space space;
  const dSpaceID simple = dSimpleSpaceCreate(nullptr);
  {
    World world(space), twin(simple);
    world.addBoxes(denseCube(n, 1));
    twin.addBoxes(denseCube(n, 1));
    const dGeomID probe = dCreateBox(nullptr, 1, 1, 1);
    const auto timeOf = [&](dSpaceID asked, int queries) {
      const auto begin = std::chrono::steady_clock::now();
      for (int i = 0; i < queries; ++i) {
        dGeomSetPosition(probe, static_cast<dReal>(i % 30), static_cast<dReal>(i / 30 % 30), 10);
        dSpaceCollide2(asGeom(asked), probe, nullptr, [](void*, dGeomID, dGeomID) {});
      }
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() /
             queries;
    };
    // Measured: 500 times quicker. Less is asked for, as the machine may be busy with other things.
    timeOf(space, 100);
    CHECK(timeOf(space, 1000) * 20 < timeOf(simple, 20));
    dGeomDestroy(probe);
  }
  dSpaceDestroy(simple);
}

// ThreadSanitizer sees it if two threads write the box of one of them.
TEST_CASE("Geoms that moved twice since the last query are found where they are", "[queries]") {
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, 3);
  for (int i = 0; i < 4000; ++i)
    dGeomSetPosition(dCreateSphere(space, 1), static_cast<dReal>(3 * i), 0, 0);
  const dGeomID probe = dCreateSphere(nullptr, 1);
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 40; ++i) CHECK(collide2(space, probe).size() == 1);
    for (const dReal height : {dReal(0.01), dReal(0)}) {
      for (int i = 0; i < 300; ++i)
        dGeomSetPosition(dSpaceGetGeom(space, i), static_cast<dReal>(3 * i), height, 0);
      dSpaceClean(space);
    }
  }
  dGeomDestroy(probe);
}
