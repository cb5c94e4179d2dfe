// The callback's rights and duties; sub-spaces, empty ones too.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/events_oracle.h"
#include "support/floating_point.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

// A callback from a lambda.
template <typename Function>
void collideWith(dSpaceID space, Function function) {
  dSpaceCollide(space, &function,
                [](void* data, dGeomID a, dGeomID b) { (*static_cast<Function*>(data))(a, b); });
}
template <typename Function>
void collideWith(const Space& space, dGeomID with, Function function) {
  dSpaceCollide2(space.geom(), with, &function,
                 [](void* data, dGeomID a, dGeomID b) { (*static_cast<Function*>(data))(a, b); });
}

struct Stop {};

}  // namespace

TEST_CASE("A touch has the place and number of its pair, whatever pairs the spaces callback adds",
          "[contract]") {
  for (const int others : {0, 200}) {
    const Space space;
    dParallelSAPSpaceSetEvents(space, dParallelSAPEventPairs | dParallelSAPEventTouches);
    for (int i = 0; i < others; ++i)
      dGeomSetPosition(dCreateSphere(space, 1), static_cast<dReal>(3 * i + 10), 0, 0);
    const dGeomID first = dCreateSphere(space, 1);
    const dSpaceID sub_space = dSimpleSpaceCreate(space);
    for (int i = 0; i < 2; ++i) (void)dCreateSphere(sub_space, 1);
    const dGeomID last = dCreateSphere(space, 1);
    dParallelSAPContactCallbacks callbacks =
        dParallelSAPContactCallbacksOf([](void*, dGeomID, dGeomID, const dContactGeom*, int) {});
    callbacks.spaces = [](void*, dGeomID a, dGeomID b, void* pairs) {
      dSpaceCollide(reinterpret_cast<dSpaceID>(dGeomIsSpace(a) ? a : b), pairs,
                    dParallelSAPAddPair);
      dSpaceCollide2(a, b, pairs, dParallelSAPAddPair);
    };
    dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
    const Events begun = begunTouchesOf(space), pairs = begunOf(space);
    REQUIRE(pairs.size() == 3);
    REQUIRE(begun.size() == 6);  // one in the sub-space, four with it
    CHECK(begun[3] == Event{first, last, 1, 1});
    CHECK(begun[3] == pairs[1]);
    // The one in the sub-space is added twice, and lasts and ends as one.
    dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
    CHECK(begunTouchesOf(space).empty());
    callbacks.flags = [](void*, dGeomID, dGeomID) { return 0; };
    dParallelSAPSpaceCollideContacts(space, nullptr, 0, &callbacks);
    CHECK(endedTouchesOf(space).size() == 6);
  }
}

TEST_CASE("The callback runs on the calling thread, in the program's mode, in a locked space",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration), other(configuration);
      dParallelSAPSpaceSetNumThreads(space, 3);
      World world(space), world_of_other(other);
      world.addBoxes(denseCube(n, 2));
      world_of_other.addBoxes(denseCube(n, 3));
      const dGeomID loose = dCreateSphere(nullptr, 1), probe = dCreateSphere(nullptr, 100);
      const dGeomID inside = world.geoms()[0];
      const std::thread::id here = std::this_thread::get_id();
      for (const bool query : {false, true}) {
        INFO(configuration.name << ", " << n << " geoms, query " << query);
        std::size_t calls = 0, elsewhere = 0, other_mode = 0;
        int assertions = 0;
        const auto forbidden = [&](auto call) {
          try {
            call();
          } catch (const OdeAssertion&) {
            ++assertions;
          }
        };
        const auto look = [&](dGeomID, dGeomID) {
          elsewhere += std::this_thread::get_id() != here;
          other_mode += FloatingPointMode::current() != FloatingPointMode::kFlushing;
          if (calls++) return;
          world_of_other.jitter(1, n);      // geoms of other spaces may change
          if (!odeHasAssertions()) return;  // callbacks_test.cpp
          forbidden([&] { dSpaceAdd(space, loose); });
          forbidden([&] { dSpaceRemove(space, inside); });
          forbidden([&] { dGeomSetPosition(inside, 1, 2, 3); });
        };
        {
          const FloatingPointMode flushing(FloatingPointMode::kFlushing);
          query ? collideWith(space, probe, look) : collideWith(space, look);
        }
        CHECK(calls > (query ? n - 1 : 0));
        CHECK(elsewhere == 0);
        CHECK(other_mode == 0);
        CHECK(assertions == (odeHasAssertions() ? 3 : 0));
        // dGeomSetPosition had its effect before the space looked at the lock; it counts from now
        // on.
        dGeomSetPosition(inside, 1, 2, 3);
        CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
        CHECK(difference(collide(other), expectedPairs(world_of_other.geoms())) == "");
        const auto stop = [&](dGeomID a, dGeomID) {
          collideWith(space, a, [](dGeomID, dGeomID) { throw Stop(); });
        };
        CHECK_THROWS_AS(query ? collideWith(space, probe, stop) : collideWith(space, stop), Stop);
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
  collideWith(space, [&](dGeomID, dGeomID) {
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
