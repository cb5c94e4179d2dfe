// The callback's rights and duties; sub-spaces, empty ones too.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
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

}  // namespace

TEST_CASE("The callback runs on the thread that collides", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration);
      dParallelSAPSpaceSetNumThreads(space, 3);
      World world(space);
      world.addBoxes(denseCube(n, 1));
      const std::thread::id here = std::this_thread::get_id();
      std::size_t calls = 0, elsewhere = 0;
      collideWith(space, [&](dGeomID, dGeomID) {
        ++calls;
        elsewhere += std::this_thread::get_id() != here;
      });
      INFO(configuration.name << ", " << n << " geoms");
      CHECK(calls > 0);
      CHECK(elsewhere == 0);
    }
  }
}

TEST_CASE("The callback receives the data pointer it was given for", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.addBoxes(onePlace(3, 1));
    static void* received;
    received = nullptr;
    int token;
    dSpaceCollide(space, &token, [](void* data, dGeomID, dGeomID) { received = data; });
    INFO(configuration.name);
    CHECK(received == &token);
  }
}

TEST_CASE("The space is locked while the callback runs, and only then", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n, 2));
      const dGeomID loose = dCreateSphere(nullptr, 1);
      const dGeomID inside = world.geoms()[0];
      REQUIRE(collide(space).size() > 0);
      INFO(configuration.name << ", " << n << " geoms");
      int assertions = 0, calls = 0;
      const auto forbidden = [&](auto call) {
        try {
          call();
        } catch (const OdeAssertion&) {
          ++assertions;
        }
      };
      collideWith(space, [&](dGeomID, dGeomID) {
        if (calls++) return;
        forbidden([&] { dSpaceAdd(space, loose); });
        forbidden([&] { dSpaceRemove(space, inside); });
        forbidden([&] { dGeomSetPosition(inside, 1, 2, 3); });
        forbidden([&] { dGeomSetCategoryBits(inside, 1); });
        forbidden([&] { dGeomSetBody(inside, nullptr); });
      });
      // Without ODE's assertions only what the space itself is asked to do is noticed.
      CHECK(assertions == (odeHasAssertions() ? 5 : 2));
      // dGeomSetPosition had its effect before ODE looked at the lock; it counts from now on.
      dGeomSetPosition(inside, 1, 2, 3);
      CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
      dSpaceAdd(space, loose);
      dSpaceRemove(space, loose);
      dGeomDestroy(loose);
    }
  }
}

TEST_CASE("The space is locked during dSpaceCollide2 as well", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.addBoxes(onePlace(20, 2));
    const dGeomID probe = dCreateSphere(nullptr, 100);
    const dGeomID loose = dCreateSphere(nullptr, 1);
    struct Data {
      dSpaceID space;
      dGeomID loose;
      int assertions;
    } data = {space, loose, 0};
    dSpaceCollide2(space.geom(), probe, &data, [](void* pointer, dGeomID, dGeomID) {
      Data& data = *static_cast<Data*>(pointer);
      try {
        dSpaceAdd(data.space, data.loose);
      } catch (const OdeAssertion&) {
        ++data.assertions;
      }
    });
    INFO(configuration.name);
    CHECK(data.assertions == 20);
    dSpaceAdd(space, loose);
    CHECK(dSpaceQuery(space, loose));
    dGeomDestroy(loose);
    dGeomDestroy(probe);
  }
}

TEST_CASE("A callback may throw at any call; the space stays usable", "[contract]") {
  struct Stop {};
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {8, 60, 1500}) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n, 3));
      const Pairs all = collide(space);
      REQUIRE(!all.empty());
      const std::size_t step = std::max<std::size_t>(1, all.size() / 12);
      INFO(configuration.name << ", " << n << " geoms");
      for (std::size_t k = 0; k < all.size(); k += step) {
        Pairs before_throw;
        const auto throwAtK = [&](dGeomID a, dGeomID b) {
          before_throw.emplace_back(number(a), number(b));
          if (before_throw.size() == k + 1) throw Stop();
        };
        CAPTURE(k);
        REQUIRE_THROWS_AS(collideWith(space, throwAtK), Stop);
        REQUIRE(before_throw.size() == k + 1);
        REQUIRE(std::equal(before_throw.begin(), before_throw.end(), all.begin()));
        // Unlocked: the contents may change, and the next frame is whole.
        const dGeomID other = dCreateSphere(space, 1);
        setNumber(other, n);
        REQUIRE(collide(space).size() >= all.size());
        dGeomDestroy(other);
        REQUIRE(difference(collide(space), all) == "");
      }
    }
  }
}

TEST_CASE("A callback of dSpaceCollide2 may throw; the space stays usable", "[contract]") {
  struct Stop {};
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.addBoxes(onePlace(20, 3));
    const dGeomID probe = dCreateSphere(nullptr, 100);
    const auto throwing = [](void*, dGeomID, dGeomID) { throw Stop(); };
    INFO(configuration.name);
    CHECK_THROWS_AS(dSpaceCollide2(space.geom(), probe, nullptr, throwing), Stop);
    CHECK_THROWS_AS(dSpaceCollide2(probe, space.geom(), nullptr, throwing), Stop);
    dGeomDestroy(dCreateSphere(space, 1));
    CHECK(collide2(space, probe).size() == 20);
    CHECK(collide(space).size() == 190);
    dGeomDestroy(probe);
  }
}

TEST_CASE("An exception leaves every space of a nest unlocked", "[contract]") {
  struct Stop {};
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

TEST_CASE("The callback may collide the same space again, from any call on", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {8, 60, 1500}) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n, 4));
      const Pairs expected = collide(space);
      REQUIRE(!expected.empty());
      const std::size_t step = expected.size() / 5 + 1;
      Pairs outer;
      std::vector<std::string> problems;
      collideWith(space, [&](dGeomID a, dGeomID b) {
        if (outer.size() % step == 0) {
          problems.push_back(difference(collide(space), expected));
          Pairs innermost;
          collideWith(space, [&](dGeomID c, dGeomID d) {
            if (innermost.empty()) problems.push_back(difference(collide(space), expected));
            innermost.emplace_back(number(c), number(d));
          });
          problems.push_back(difference(innermost, expected));
        }
        outer.emplace_back(number(a), number(b));
      });
      INFO(configuration.name << ", " << n << " geoms");
      CHECK(difference(outer, expected) == "");
      CHECK(problems.size() >= 3);
      for (const std::string& problem : problems) CHECK(problem == "");
      CHECK(difference(collide(space), expected) == "");
    }
  }
}

TEST_CASE("The callback may collide other spaces and single geoms", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration), other(configuration);
    World world(space), world_of_other(other);
    world.addBoxes(denseCube(300, 5));
    world_of_other.addBoxes(denseCube(400, 6));
    const Pairs expected = collide(space), expected_of_other = collide(other);
    const dGeomID probe = dCreateSphere(nullptr, 3);
    setNumber(probe, 999);
    const Pairs expected_of_probe = collide2(space, probe);
    REQUIRE(!expected.empty());
    REQUIRE(!expected_of_probe.empty());
    Pairs outer;
    std::vector<std::string> problems;
    collideWith(space, [&](dGeomID a, dGeomID b) {
      if (outer.size() % 200 == 0) {
        problems.push_back(difference(collide(other), expected_of_other));
        problems.push_back(difference(collide2(space, probe), expected_of_probe));
        problems.push_back(collide2(a, b).size() == 1 ? "" : "a pair on its own is none");
        problems.push_back(collide2(space.geom(), other.geom()).empty() ? "no pair" : "");
      }
      outer.emplace_back(number(a), number(b));
    });
    INFO(configuration.name);
    CHECK(difference(outer, expected) == "");
    CHECK(problems.size() >= 4);
    for (const std::string& problem : problems) CHECK(problem == "");
    dGeomDestroy(probe);
  }
}

TEST_CASE("A callback that throws out of a collide within a collide does no harm", "[contract]") {
  struct Stop {};
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {8, 1500}) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n, 7));
      const Pairs expected = collide(space);
      Pairs outer;
      int caught = 0;
      collideWith(space, [&](dGeomID a, dGeomID b) {
        outer.emplace_back(number(a), number(b));
        if (outer.size() > 3) return;
        try {
          collideWith(space, [](dGeomID, dGeomID) { throw Stop(); });
        } catch (const Stop&) {
          ++caught;
        }
      });
      INFO(configuration.name << ", " << n << " geoms");
      CHECK(caught == static_cast<int>(std::min<std::size_t>(3, expected.size())));
      CHECK(difference(outer, expected) == "");
      dGeomDestroy(dCreateSphere(space, 1));
    }
  }
}

TEST_CASE("What the callback disables or enables is seen by the next collide", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.addBoxes(onePlace(30, 1));
    const dGeomID last = world.geoms().back();
    INFO(configuration.name);
    std::size_t calls = 0;
    collideWith(space, [&](dGeomID, dGeomID) {
      if (calls++ == 0) dGeomDisable(last);
    });
    CHECK(calls == 435);
    CHECK(collide(space).size() == 406);
    calls = 0;
    collideWith(space, [&](dGeomID, dGeomID) {
      if (calls++ == 0) dGeomEnable(last);
    });
    CHECK(calls == 406);
    CHECK(collide(space).size() == 435);
  }
}

TEST_CASE("Bodies that the callback disables or enables are asleep or awake for the next collide",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    dParallelSAPSpaceSetSkipAsleep(space, 1);
    World world(space);
    world.addBoxes(onePlace(30, 1));
    for (const dGeomID geom : world.geoms()) world.giveBody(geom);
    INFO(configuration.name);
    const auto collideAndTurn = [&](void (*turn)(dBodyID)) {
      std::size_t calls = 0;
      collideWith(space, [&](dGeomID, dGeomID) {
        for (std::size_t i = 1; i < 30 && calls == 0; ++i) turn(world.bodies()[i]);
        ++calls;
      });
      return calls;
    };
    CHECK(collideAndTurn(dBodyDisable) == 435);
    CHECK(collideAndTurn(dBodyEnable) == 29);
    CHECK(collide(space).size() == 435);
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

TEST_CASE("The callback runs in the program's own floating-point mode", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n, 16));
      const dGeomID probe = dCreateSphere(nullptr, 100);
      static std::size_t calls, strange;
      calls = strange = 0;
      const auto look = [](void*, dGeomID, dGeomID) {
        ++calls;
        strange += FloatingPointMode::current() != FloatingPointMode::kFlushing;
      };
      {
        const FloatingPointMode flushing(FloatingPointMode::kFlushing);
        dSpaceCollide(space, nullptr, look);
        dSpaceCollide2(space.geom(), probe, nullptr, look);
      }
      dGeomDestroy(probe);
      INFO(configuration.name << ", " << n << " geoms");
      CHECK(calls > n);
      CHECK(strange == 0);
    }
  }
}

TEST_CASE("A sub-space without a geom at any depth is never reported, whatever is at the origin",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {4, 100, 1500}) {
      for (const int depth : {1, 2, 4}) {
        const Space space(configuration);
        World world(space);
        world.addBoxes(denseCube(n - 3, 15));
        world.take(dCreateSphere(space, 1));  // around the origin
        world.take(dCreatePlane(space, 1, 1, 1, 0));
        const dSpaceID sub_space = dHashSpaceCreate(space);
        world.take(asGeom(sub_space));
        dSpaceID innermost = sub_space;
        for (int i = 1; i < depth; ++i) {
          dHashSpaceCreate(innermost);
          innermost = i % 2 ? dSimpleSpaceCreate(innermost) : dParallelSAPSpaceCreate(innermost);
        }
        // A space around it makes dSpaceCollide2 ask about the sub-space itself.
        const dSpaceID around = dSimpleSpaceCreate(nullptr);
        const dSpaceID asked = dSimpleSpaceCreate(around);
        const dSpaceID asked_within = dHashSpaceCreate(asked);
        INFO(configuration.name << ", " << n << " geoms, depth " << depth);
        std::size_t contacts_of_spaces = 0;
        dParallelSAPContactCallbacks callbacks = {};
        callbacks.contacts = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
        callbacks.spaces = [](void* count, dGeomID, dGeomID, void*) {
          ++*static_cast<std::size_t*>(count);
        };
        const auto isSubSpace = [&](std::size_t place) {
          return place == number(asGeom(sub_space));
        };
        const auto pairsOfSubSpace = [&] {
          const Pairs got = collide(space);
          REQUIRE(difference(got, expectedPairs(world.geoms())) == "");
          std::size_t count = 0;
          for (const Pair& pair : got) count += isSubSpace(pair.first) || isSubSpace(pair.second);
          contacts_of_spaces = 0;
          dParallelSAPSpaceCollideContacts(space, &contacts_of_spaces, 1, &callbacks);
          CHECK(contacts_of_spaces == count);
          REQUIRE(difference(collide(space), got) == "");  // once more, as nothing moved
          const dGeomID probe = dCreateSphere(nullptr, 1);
          for (const Pair& pair : collide2(space, probe)) CHECK((count || !isSubSpace(pair.first)));
          dGeomDestroy(probe);
          return count;
        };
        CHECK(collide2(space.geom(), asGeom(around)).empty());
        const dGeomID asked_ball = dCreateSphere(asked_within, 1);
        CHECK_FALSE(collide2(space.geom(), asGeom(around)).empty());
        dGeomDestroy(asked_ball);
        CHECK(collide2(space.geom(), asGeom(around)).empty());
        dSpaceDestroy(around);
        CHECK(pairsOfSubSpace() == 0);
        const dGeomID inside = dCreateSphere(innermost, dReal(0.5));
        CHECK(pairsOfSubSpace() >= 2);
        dGeomSetPosition(inside, -50, -50, -50);
        // The plane; an empty space beside it reaches to the origin.
        CHECK((pairsOfSubSpace() == 1) == (depth == 1));
        dGeomDestroy(inside);
        CHECK(pairsOfSubSpace() == 0);
        const dGeomID again = dCreateSphere(innermost, dReal(0.5));
        CHECK(pairsOfSubSpace() >= 2);
        dSpaceRemove(innermost, again);
        CHECK(pairsOfSubSpace() == 0);
        dGeomDestroy(again);
      }
    }
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

TEST_CASE("Fifty spaces within each other find the geoms at the bottom", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    dSpaceID bottom = space;
    for (int i = 0; i < 50; ++i) {
      if (i % 3 == 0) {
        bottom = dSimpleSpaceCreate(bottom);
      } else {
        bottom = dParallelSAPSpaceCreate(bottom);
        configure(bottom, configuration);
      }
    }
    setNumber(dSpaceGetGeom(space, 0), 1);
    const dGeomID deep = dCreateSphere(bottom, 1);
    const dGeomID shallow = dCreateSphere(space, 1);
    setNumber(shallow, 2);
    INFO(configuration.name);
    CHECK(difference(collide(space), {{1, 2}}) == "");
    dGeomSetPosition(deep, 10, 0, 0);
    CHECK(collide(space).empty());
    dGeomSetPosition(shallow, 10, 0, 0);
    CHECK(difference(collide(space), {{1, 2}}) == "");
    dGeomSetPosition(deep, 0, 10, 0);
    dSpaceClean(bottom);  // the spaces above still have to notice
    CHECK(collide(space).empty());
  }
}
