// The callback's rights and duties; sub-spaces, empty ones too.
#include <ode_parallel_sap/parallel_sap_space.h>

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

TEST_CASE("The callback runs on the calling thread, with the space locked, in the program's mode",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration);
      dParallelSAPSpaceSetNumThreads(space, 3);
      World world(space);
      world.addBoxes(denseCube(n, 2));
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
          forbidden([&] { dSpaceAdd(space, loose); });
          forbidden([&] { dSpaceRemove(space, inside); });
          forbidden([&] { dGeomSetPosition(inside, 1, 2, 3); });
          forbidden([&] { dGeomSetCategoryBits(inside, 1); });
          forbidden([&] { dGeomSetBody(inside, nullptr); });
        };
        {
          const FloatingPointMode flushing(FloatingPointMode::kFlushing);
          query ? collideWith(space, probe, look) : collideWith(space, look);
        }
        CHECK(calls > (query ? n - 1 : 0));
        CHECK(elsewhere == 0);
        CHECK(other_mode == 0);
        // Without ODE's assertions only what the space itself is asked to do is noticed.
        CHECK(assertions == (odeHasAssertions() ? 5 : 2));
        // dGeomSetPosition had its effect before ODE looked at the lock; it counts from now on.
        dGeomSetPosition(inside, 1, 2, 3);
        CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
        dSpaceAdd(space, loose);
        dSpaceRemove(space, loose);
      }
      dGeomDestroy(loose);
      dGeomDestroy(probe);
    }
  }
}

TEST_CASE("The callback may collide this space again, other spaces and geoms, and catch exceptions",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {8, 60, 1500}) {
      const Space space(configuration), other(configuration);
      World world(space), world_of_other(other);
      world.addBoxes(denseCube(n, 4));
      world_of_other.addBoxes(denseCube(n + 100, 6));
      const dGeomID probe = dCreateSphere(nullptr, 3);
      const Pairs expected = collide(space), expected_of_other = collide(other),
                  expected_of_probe = collide2(space, probe);
      REQUIRE(!expected.empty());
      REQUIRE(!expected_of_probe.empty());
      Pairs outer;
      std::string problem;
      std::size_t caught = 0;
      const std::size_t step = expected.size() / 5 + 1;
      collideWith(space, [&](dGeomID a, dGeomID b) {
        outer.emplace_back(number(a), number(b));
        if (outer.size() % step != 1 % step) return;
        Pairs inner;
        collideWith(space, [&](dGeomID c, dGeomID d) {
          if (inner.empty()) problem += difference(collide(space), expected);
          inner.emplace_back(number(c), number(d));
        });
        problem += difference(inner, expected);
        problem += difference(collide(other), expected_of_other);
        problem += difference(collide2(space, probe), expected_of_probe);
        problem += collide2(a, b).size() == 1 ? "" : "a pair on its own is none";
        problem += collide2(space.geom(), other.geom()).empty() ? "no pair of two spaces" : "";
        try {
          collideWith(space, [](dGeomID, dGeomID) { throw Stop(); });
        } catch (const Stop&) {
          ++caught;
        }
      });
      INFO(configuration.name << ", " << n << " geoms");
      CHECK(difference(outer, expected) == "");
      CHECK(problem == "");
      CHECK(caught > 0);
      dGeomDestroy(dCreateSphere(space, 1));  // not locked
      CHECK(difference(collide(space), expected) == "");
      dGeomDestroy(probe);
    }
  }
}

TEST_CASE("Geoms and bodies that the callback disables or enables count in the next collide",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.addBoxes(onePlace(30, 1));
    for (const dGeomID geom : world.geoms()) world.giveBody(geom);
    const auto collideAnd = [&](auto change) {
      std::size_t calls = 0;
      collideWith(space, [&](dGeomID, dGeomID) {
        if (calls++ == 0) change();
      });
      return calls;
    };
    const auto turnBodies = [&](void (*turn)(dBodyID)) {
      for (std::size_t i = 1; i < 30; ++i) turn(world.bodies()[i]);
    };
    INFO(configuration.name);
    CHECK(collideAnd([&] { dGeomDisable(world.geoms().back()); }) == 435);
    CHECK(collideAnd([&] { dGeomEnable(world.geoms().back()); }) == 406);
    dParallelSAPSpaceSetSkipAsleep(space, 1);
    CHECK(collideAnd([&] { turnBodies(dBodyDisable); }) == 435);
    CHECK(collideAnd([&] { turnBodies(dBodyEnable); }) == 29);
    CHECK(collide(space).size() == 435);
  }
}

TEST_CASE("An exception leaves every space of a nest unlocked", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space outer(configuration);
    const dSpaceID inner = dParallelSAPSpaceCreate(outer);
    configure(inner, configuration);
    for (int i = 0; i < 3; ++i) dCreateSphere(inner, 1);
    for (int i = 0; i < 3; ++i) dCreateSphere(outer, 1);
    const auto takeApart = [](void*, dGeomID a, dGeomID b) {
      dSpaceCollide2(a, b, nullptr, [](void*, dGeomID, dGeomID) { throw Stop(); });
    };
    INFO(configuration.name);
    CHECK_THROWS_AS(dSpaceCollide(outer, nullptr, takeApart), Stop);
    dCreateSphere(inner, 1);
    dCreateSphere(outer, 1);
    CHECK(collide(outer).size() == 10);
    CHECK(collide(inner).size() == 6);
  }
}

TEST_CASE("The callback may change geoms of other spaces, which see it in their next collide",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration), other(configuration);
      World world(space), world_of_other(other);
      world.addBoxes(denseCube(n, 17));
      world_of_other.addBoxes(denseCube(n, 18));
      (void)collide(other);
      const std::vector<dGeomID>& geoms = world_of_other.geoms();
      int calls = 0;
      collideWith(space, [&](dGeomID, dGeomID) {
        if (calls++) return;
        dGeomSetPosition(geoms[0], 1, 2, 3);
        dGeomBoxSetLengths(geoms[1], 3, 3, 3);
        dGeomSetCategoryBits(geoms[2], 2);
        dGeomSetCollideBits(geoms[2], 2);
        const dBodyID body = world_of_other.giveBody(geoms[3]);
        dGeomSetBody(geoms[4], body);
        dGeomDisable(geoms[5]);
        const dGeomID again = geoms[6];
        world_of_other.remove(again);
        world_of_other.addAgain(again);
      });
      INFO(configuration.name << ", " << n << " geoms");
      CHECK(calls > 0);
      CHECK(difference(collide(other), expectedPairs(geoms)) == "");
      CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
    }
  }
}

TEST_CASE("A sub-space without a geom at any depth is never reported, whatever is at the origin",
          "[contract]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {4, 100, 1500})
      for (const int depth : {1, 2, 4}) {
        INFO(configuration.name << ", " << n << " geoms, depth " << depth);
        const Space space(configuration);
        World world(space);
        world.addBoxes(denseCube(n - 3, 15));
        world.take(dCreateSphere(space, 1));  // around the origin
        world.take(dCreatePlane(space, 1, 1, 1, 0));
        // A space around it makes dSpaceCollide2 ask about the sub-space itself.
        const dSpaceID around = dSimpleSpaceCreate(nullptr);
        const dSpaceID outside = dHashSpaceCreate(dSimpleSpaceCreate(around));
        const dSpaceID sub_space = dHashSpaceCreate(space);
        const std::size_t own = number(world.take(asGeom(sub_space)));
        dSpaceID innermost = sub_space;
        for (int i = 1; i < depth; ++i) {
          dHashSpaceCreate(innermost);
          innermost = i % 2 ? dSimpleSpaceCreate(innermost) : dParallelSAPSpaceCreate(innermost);
        }
        const auto pairsOfSubSpace = [&] {
          const Pairs got = collide(space);
          REQUIRE(difference(got, expectedPairs(world.geoms())) == "");
          std::size_t count = 0, of_contacts = 0;
          for (const Pair& pair : got) count += pair.first == own || pair.second == own;
          dParallelSAPContactCallbacks callbacks = {};
          callbacks.contacts = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
          callbacks.spaces = [](void* count, dGeomID, dGeomID, void*) {
            ++*static_cast<std::size_t*>(count);
          };
          dParallelSAPSpaceCollideContacts(space, &of_contacts, 1, &callbacks);
          CHECK(of_contacts == count);
          const dGeomID probe = dCreateSphere(nullptr, 1);
          for (const Pair& pair : collide2(space, probe)) CHECK((count || pair.first != own));
          dGeomDestroy(probe);
          return count;
        };
        for (const bool destroy : {true, false}) {
          CHECK(collide2(space.geom(), asGeom(around)).empty());
          CHECK(pairsOfSubSpace() == 0);
          const dGeomID inside = dCreateSphere(innermost, dReal(0.5));
          const dGeomID ball = dCreateSphere(outside, 1);
          CHECK_FALSE(collide2(space.geom(), asGeom(around)).empty());
          CHECK(pairsOfSubSpace() >= 2);
          dGeomSetPosition(inside, -50, -50, -50);
          // The plane; an empty space beside it reaches to the origin.
          CHECK((pairsOfSubSpace() == 1) == (depth == 1));
          if (!destroy) dSpaceRemove(innermost, inside);
          dGeomDestroy(inside);
          dGeomDestroy(ball);
        }
        CHECK(pairsOfSubSpace() == 0);
        dSpaceDestroy(around);
      }
}

#ifndef NDEBUG
TEST_CASE("Two threads in one space at once are an assertion in debug builds", "[contract]") {
  const Space space;
  World world(space);
  world.addBoxes(onePlace(2, 1));
  std::string said;
  collideWith(space, [&](dGeomID, dGeomID) {
    std::thread([&] {
      dAllocateODEDataForThread(dAllocateMaskAll);
      try {
        collide(space);
      } catch (const OdeAssertion& assertion) {
        said = assertion.what();
      }
      dCleanupODEAllDataForThread();
    }).join();
    collide(space);  // the same thread may
  });
  CHECK(said.find("two threads use it at the same time") != std::string::npos);
  std::size_t pairs = 0;
  std::thread([&] { pairs = collide(space).size(); }).join();
  CHECK(pairs == 1);
}
#endif
