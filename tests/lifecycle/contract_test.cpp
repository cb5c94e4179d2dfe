// The callback's rights and duties; sub-spaces, empty ones too.
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "support/calls.h"
#include "support/floating_point.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

struct Stop {};

}  // namespace

TEST_CASE("The callback runs on the calling thread, in the program's mode, in a locked space",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration), other(configuration);
      World world(space, denseCube(n, 2)), world_of_other(other, denseCube(n, 3));
      const dGeomID loose = dCreateSphere(nullptr, 1), probe = dCreateSphere(nullptr, 100);
      const dGeomID inside = world.geoms()[0];
      const std::thread::id here = std::this_thread::get_id();
      for (const Call call : {kNear, kQuery, kSharedBlocks}) {
        INFO(configuration.name << ", " << n << " geoms, call " << call);
        dParallelSAPSpaceSetNumThreads(space, call == kSharedBlocks ? 1 : 3);
        // Only where an ODE has no assertions may callbacks change the space, but for blocks.
        const bool is_locked = odeHasAssertions() || call == kSharedBlocks;
        std::size_t calls = 0, elsewhere = 0, other_mode = 0;
        std::vector<std::string> said;
        const auto forbidden = [&](auto change) {
          try {
            change();
          } catch (const OdeAssertion& assertion) {
            said.push_back(assertion.what());
          }
        };
        auto look = [&](auto...) {
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
          report(call, space, {probe}, look);
        }
        CHECK(calls > (call == kQuery ? n - 1 : 0));
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
        auto stop = [&](auto...) {
          for (const dGeomID geom : world.geoms())  // queries in the frame
            collide2(asGeom(space), geom, [](dGeomID, dGeomID) { throw Stop(); });
        };
        CHECK_THROWS_AS(report(call, space, {probe}, stop), Stop);
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
  World world(space, onePlace(2, 1));
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
  collide(space, [&](dGeomID, dGeomID) {
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
