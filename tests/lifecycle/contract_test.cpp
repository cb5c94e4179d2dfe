// The callback's rights and duties; sub-spaces, empty ones too.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/floating_point.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

enum Way { kNear, kQuery, kBlocks };

// What a space reports to a callback from a lambda, of a block its first pair.
template <typename Function>
void collideBy(Way way, dSpaceID space, dGeomID with, Function function) {
  const auto call = [](void* data, dGeomID a, dGeomID b) { (*static_cast<Function*>(data))(a, b); };
  const auto block = [](void* data, const dParallelSAPPair* pairs, std::size_t, std::size_t) {
    (*static_cast<Function*>(data))(pairs->o1, pairs->o2);
  };
  if (way == kNear) dSpaceCollide(space, &function, call);
  if (way == kQuery) dSpaceCollide2(asGeom(space), with, &function, call);
  if (way == kBlocks)
    dParallelSAPSpaceCollidePairs(space, &function, dParallelSAPPairsConcurrent, block);
}

struct Stop {};

}  // namespace

TEST_CASE("The callback runs on the calling thread, in the program's mode, in a locked space",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration), other(configuration);
      World world(space), world_of_other(other);
      world.addBoxes(denseCube(n, 2));
      world_of_other.addBoxes(denseCube(n, 3));
      const dGeomID loose = dCreateSphere(nullptr, 1), probe = dCreateSphere(nullptr, 100);
      const dGeomID inside = world.geoms()[0];
      const std::thread::id here = std::this_thread::get_id();
      for (const Way way : {kNear, kQuery, kBlocks}) {
        INFO(configuration.name << ", " << n << " geoms, way " << way);
        dParallelSAPSpaceSetNumThreads(space, way == kBlocks ? 1 : 3);
        // Only where an ODE has no assertions may callbacks change the space, but for blocks.
        const bool is_locked = odeHasAssertions() || way == kBlocks;
        std::size_t calls = 0, elsewhere = 0, other_mode = 0;
        std::vector<std::string> said;
        const auto forbidden = [&](auto call) {
          try {
            call();
          } catch (const OdeAssertion& assertion) {
            said.push_back(assertion.what());
          }
        };
        const auto look = [&](dGeomID, dGeomID) {
          elsewhere += std::this_thread::get_id() != here;
          other_mode += FloatingPointMode::current() != FloatingPointMode::kFlushing;
          if (calls++) return;
          world_of_other.jitter(1, n);  // geoms of other spaces may change
          if (!is_locked) return;       // callbacks_test.cpp
          forbidden([&] { dSpaceAdd(space, loose); });
          forbidden([&] { dSpaceRemove(space, inside); });
          if (odeHasAssertions()) forbidden([&] { dGeomSetPosition(inside, 1, 2, 3); });
        };
        {
          const FloatingPointMode flushing(FloatingPointMode::kFlushing);
          collideBy(way, space, probe, look);
        }
        CHECK(calls > (way == kQuery ? n - 1 : 0));
        CHECK(elsewhere == 0);
        CHECK(other_mode == 0);
        REQUIRE(said.size() == (odeHasAssertions() ? 3 : is_locked ? 2 : 0));
        for (std::size_t i = 0; i < std::min<std::size_t>(2, said.size()); ++i)
          CHECK(said[i] == std::string("Invalid operation for locked space in ") +
                               (i ? "dSpaceRemove()" : "dSpaceAdd()"));
        CHECK(dSpaceGetNumGeoms(space) == static_cast<int>(n));
        // dGeomSetPosition had its effect before the space looked at the lock; it counts from now
        // on.
        dGeomSetPosition(inside, 1, 2, 3);
        CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
        CHECK(difference(collide(other), expectedPairs(world_of_other.geoms())) == "");
        const auto stop = [&](dGeomID a, dGeomID) {
          collideBy(kQuery, space, a, [](dGeomID, dGeomID) { throw Stop(); });
        };
        CHECK_THROWS_AS(collideBy(way, space, probe, stop), Stop);
        dSpaceAdd(space, loose);
        dSpaceRemove(space, loose);
      }
      dGeomDestroy(loose);
      dGeomDestroy(probe);
    }
  }
}

#ifndef NDEBUG
TEST_CASE("Two threads in one space at once are an assertion in debug builds", "[contract]") {
  const Space space;
  World world(space);
  world.addBoxes(onePlace(2, 1));
  std::atomic<int> found{0};
  const auto onItsOwn = [&](const std::function<void()>& call) {
    return std::thread([&found, call] {
      dAllocateODEDataForThread(dAllocateMaskAll);
      try {
        call();
      } catch (const OdeAssertion& assertion) {
        const std::string said = assertion.what();
        found += said.find("two threads use it at the same time") != std::string::npos;
      }
      dCleanupODEAllDataForThread();
    });
  };
  collideBy(kNear, space, nullptr, [&](dGeomID, dGeomID) {
    onItsOwn([&] { collide(space); }).join();
    collide(space);  // the same thread may
  });
  CHECK(found == 1);
  std::size_t pairs = 0;
  std::thread([&] { pairs = collide(space).size(); }).join();
  CHECK(pairs == 1);

  // Two that add and remove, until they meet.
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  const auto churn = [&](dGeomID geom) {
    while (found == 1 && std::chrono::steady_clock::now() < end)
      dGeomGetSpace(geom) ? dSpaceRemove(space, geom) : dSpaceAdd(space, geom);
  };
  const dGeomID geoms[] = {dCreateSphere(nullptr, 1), dCreateSphere(nullptr, 1)};
  std::thread other = onItsOwn([&] { churn(geoms[0]); });
  onItsOwn([&] { churn(geoms[1]); }).join();
  other.join();
  CHECK(found == 2);
  for (const dGeomID geom : geoms) dGeomDestroy(geom);
}
#endif
