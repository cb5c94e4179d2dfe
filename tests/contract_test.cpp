// The callback's rights and duties, bounds that nobody should have, sub-spaces that are empty.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

const dReal kInfinity = std::numeric_limits<dReal>::infinity();
const dReal kLargest = std::numeric_limits<dReal>::max();
const dReal kDenormal = std::numeric_limits<dReal>::denorm_min();
const dReal kNaN = std::numeric_limits<dReal>::quiet_NaN();

dParallelSAPStats statsOf(dSpaceID space) {
  dParallelSAPStats stats;
  dParallelSAPSpaceGetStats(space, &stats);
  return stats;
}

dGeomID asGeom(dSpaceID space) {
  return reinterpret_cast<dGeomID>(space);
}

// A callback from a lambda.
template <typename Function>
void collideWith(dSpaceID space, Function function) {
  dSpaceCollide(space, &function,
                [](void* data, dGeomID a, dGeomID b) { (*static_cast<Function*>(data))(a, b); });
}

// The sizes at which a space does its work in different ways.
const std::size_t kSceneSizes[] = {8, 200, 3000};

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

TEST_CASE("A NaN bound leaves its geom out, is reported once, counted always, and heals",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      for (int bound = 0; bound<6; bound += n> 1000 ? 5 : 1) {
        const Space space(configuration);
        World world(space);
        world.addBoxes(denseCube(n - 1, 8));
        const Bounds sound = {-100, 100, -100, 100, -100, 100};
        const dGeomID sick = world.take(createUserBox(space, sound));
        const Messages messages;
        INFO(configuration.name << ", " << n << " geoms, bound " << bound);
        const Pairs healthy = collide(space);
        REQUIRE(difference(healthy, expectedPairs(world.geoms())) == "");
        REQUIRE(statsOf(space).invalid == 0);
        REQUIRE(messages.all().empty());

        Bounds broken = sound;
        broken[bound] = bound % 2 ? kNaN : -kNaN;
        setUserBounds(sick, broken);
        for (int frame = 0; frame < 3; ++frame) {
          const Pairs got = collide(space);
          REQUIRE(difference(got, expectedPairs(world.geoms())) == "");
          REQUIRE(got.size() == healthy.size() - (n - 1));
          REQUIRE(statsOf(space).invalid == 1);
          REQUIRE(messages.all().size() == 1);
        }
        setUserBounds(sick, sound);
        REQUIRE(difference(collide(space), healthy) == "");
        REQUIRE(statsOf(space).invalid == 0);
        REQUIRE(messages.all().size() == 1);
      }
    }
  }
}

TEST_CASE("NaN positions and rotations of ordinary geoms and bodies leave them out", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n - 3, 9));
      const dGeomID position = world.take(dCreateSphere(space, 100));
      const dGeomID rotation = world.take(dCreateBox(space, 100, 100, 100));
      const dGeomID carried = world.take(dCreateSphere(space, 100));
      const dBodyID body = world.giveBody(carried);
      const Messages messages;
      INFO(configuration.name << ", " << n << " geoms");
      const Pairs healthy = collide(space);
      dGeomSetPosition(position, kNaN, 0, 0);
      dMatrix3 identity, broken;
      dRSetIdentity(identity);
      dRSetIdentity(broken);
      broken[5] = kNaN;
      dGeomSetRotation(rotation, broken);
      dBodySetPosition(body, 0, 0, kNaN);
      CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
      // dGeomSetRotation may have mended the matrix; the other two are surely broken.
      const std::size_t invalid = statsOf(space).invalid;
      CHECK(invalid >= 2);
      CHECK(messages.all().size() == invalid);
      dGeomSetPosition(position, 0, 0, 0);
      dGeomSetRotation(rotation, identity);
      dBodySetPosition(body, 0, 0, 0);
      CHECK(difference(collide(space), healthy) == "");
      CHECK(statsOf(space).invalid == 0);
      CHECK(messages.all().size() == invalid);
    }
  }
}

TEST_CASE("A scene of nothing but NaN has no pairs", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {1, 2, 8, 100, 1000}) {
      const Space space(configuration);
      World world(space);
      for (std::size_t i = 0; i < n; ++i) {
        world.take(createUserBox(space, {0, 1, 0, kNaN, 0, 1}));
      }
      const Messages messages;
      INFO(configuration.name << ", " << n << " geoms");
      CHECK(collide(space).empty());
      CHECK(collide(space).empty());
      CHECK(statsOf(space).invalid == n);
      CHECK(messages.all().size() == n);
    }
  }
}

TEST_CASE("A geom with a NaN bound is in no pair of dSpaceCollide2", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.take(dCreateSphere(space, 1));
    const dGeomID sick = world.take(createUserBox(space, {0, 1, 0, kNaN, 0, 1}));
    const dGeomID probe = dCreateSphere(nullptr, 1);
    setNumber(probe, 9);
    const Messages messages;
    INFO(configuration.name);
    CHECK(difference(collide2(space, probe), {{0, 9}}) == "");
    dSpaceRemove(space, sick);
    CHECK(collide2(space, sick).empty());
    CHECK(collide2(sick, space.geom()).empty());
    dGeomDestroy(probe);
  }
}

namespace {

// Bounds that nobody should have, all of them with an order.
const std::vector<dReal>& extremes() {
  static const std::vector<dReal> values = {-kInfinity,
                                            -kLargest,
                                            -kLargest / 2,
                                            static_cast<dReal>(-1e30),
                                            -1,
                                            -kDenormal,
                                            dReal(-0.0),
                                            0,
                                            kDenormal,
                                            std::numeric_limits<dReal>::min(),
                                            1,
                                            dReal(1) + std::numeric_limits<dReal>::epsilon(),
                                            static_cast<dReal>(1e30),
                                            kLargest / 2,
                                            kLargest,
                                            kInfinity};
  return values;
}

Bounds extremeBounds(Random& random, bool inverted_too) {
  Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    dReal low = extremes()[random.below(extremes().size())];
    dReal high = extremes()[random.below(extremes().size())];
    if (low > high && !(inverted_too && random.chance(0.3))) std::swap(low, high);
    bounds[2 * axis] = low;
    bounds[2 * axis + 1] = high;
  }
  return bounds;
}

}  // namespace

TEST_CASE("Bounds that no float tells apart are told apart, around zero too", "[contract]") {
  const dReal epsilon = std::numeric_limits<dReal>::epsilon();
  std::vector<std::array<dReal, 2>> gaps = {
      {kDenormal, 2 * kDenormal}, {0, kDenormal},   {-kDenormal, 0},
      {-kDenormal, kDenormal},    {1, 1 + epsilon}, {-1 - epsilon, -1},
      {kLargest / 2, kLargest}};
  if (sizeof(dReal) == sizeof(double)) {
    for (const double low : {1e-320, 1e-310, 1e-50, 1e-20, 1.0, 1e30, 1e39, 1e300}) {
      const dReal near = static_cast<dReal>(low), far = static_cast<dReal>(low * (1 + 1e-3));
      gaps.push_back({near, far});
      gaps.push_back({-far, -near});
    }
  }
  for (const Configuration& configuration : configurations()) {
    for (const auto& [low, high] : gaps) {
      const Space space(configuration);
      World world(space);
      REQUIRE(low < high);
      for (int axis = 0; axis < 3; ++axis) {
        Bounds below = {0, 1, 0, 1, 0, 1}, above = below;
        below[2 * axis] = -kLargest;
        below[2 * axis + 1] = low;
        above[2 * axis] = high;
        above[2 * axis + 1] = kLargest;
        world.take(createUserBox(space, below));
        world.take(createUserBox(space, above));
      }
      // Enough of them to pass by whatever serves the smallest scenes.
      for (int i = 0; i < 20; ++i) world.take(createUserBox(space, {5, 6, 5, 6, 5, 6}));
      INFO(configuration.name << ", between " << low << " and " << high);
      CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
    }
  }
}

TEST_CASE("Extreme bounds alone follow the formula", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const int rounds = scaled(40);
    for (int round = 0; round < rounds; ++round) {
      const std::uint64_t seed = seedOr(60 + static_cast<std::uint64_t>(round));
      Random random(seed);
      const Space space(configuration);
      World world(space);
      for (std::size_t i = 2 + random.below(150); i > 0; --i) {
        world.take(createUserBox(space, extremeBounds(random, round % 2 == 0)));
      }
      const Messages messages;
      INFO(configuration.name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
      REQUIRE(messages.all().empty());
      REQUIRE(statsOf(space).invalid == 0);
    }
  }
}

#if defined(__SSE2__)
TEST_CASE("A program's flushing of denormals and its rounding change no pair", "[contract]") {
  const unsigned before = _mm_getcsr() & ~0x3fu;  // the sticky flags are nobody's setting
  const unsigned modes[] = {before | 0x8040, before | 0x2000, before | 0x4000, before | 0x6000};
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {8, 100, 3000}) {
      const Space space(configuration);
      dParallelSAPSpaceSetNumThreads(space, 3);
      World world(space);
      Random random(seedOr(90));
      for (std::size_t i = 0; i < n / 2; ++i) {
        world.take(createUserBox(space, extremeBounds(random, true)));
        world.take(createUserBox(space, {static_cast<dReal>(random.unit()), 1, 0, 1,
                                         static_cast<dReal>(-random.unit()), 0}));
      }
      const Pairs expected = expectedPairs(world.geoms());
      for (const unsigned mode : modes) {
        _mm_setcsr(mode);
        const Pairs got = collide(space);
        const unsigned after = _mm_getcsr() & ~0x3fu;
        _mm_setcsr(before);
        INFO(configuration.name << ", " << n << " geoms, MXCSR " << std::hex << mode);
        REQUIRE(difference(got, expected) == "");
        REQUIRE(after == mode);
      }
    }
  }
}

TEST_CASE("The callback runs in the program's own floating-point mode", "[contract]") {
  const unsigned before = _mm_getcsr() & ~0x3fu, flushing = before | 0x8040;
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n, 16));
      const dGeomID probe = dCreateSphere(nullptr, 100);
      static std::size_t calls, strange;
      static unsigned wanted;
      calls = strange = 0;
      wanted = flushing;
      const auto look = [](void*, dGeomID, dGeomID) {
        ++calls;
        strange += (_mm_getcsr() & ~0x3fu) != wanted;
      };
      _mm_setcsr(flushing);
      dSpaceCollide(space, nullptr, look);
      dSpaceCollide2(space.geom(), probe, nullptr, look);
      _mm_setcsr(before);
      dGeomDestroy(probe);
      INFO(configuration.name << ", " << n << " geoms");
      CHECK(calls > n);
      CHECK(strange == 0);
    }
  }
}
#endif

TEST_CASE("Extreme bounds among ordinary ones follow the formula and harm nobody", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {50, 1000, 4000}) {
      const std::uint64_t seed = seedOr(70 + n);
      Random random(seed);
      const Space space(configuration);
      World world(space);
      for (const Box& box : denseCube(n, seed)) {
        if (random.chance(0.01)) {
          world.take(createUserBox(space, extremeBounds(random, true)));
        } else {
          world.addBox(box);
        }
      }
      INFO(configuration.name << ", " << n << " geoms, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
      // The extremes change places with ordinary bounds from frame to frame.
      for (int frame = 0; frame < 3; ++frame) {
        for (const dGeomID geom : world.geoms()) {
          if (!isUserBox(geom)) continue;
          setUserBounds(
              geom, random.chance(0.5) ? extremeBounds(random, true) : Bounds{1, 2, 1, 2, 1, 2});
        }
        REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
      }
    }
  }
}

TEST_CASE("A scene of any scale, at any distance from the origin, follows the formula",
          "[contract]") {
  const double largest = static_cast<double>(kLargest);
  const double scales[] = {static_cast<double>(kDenormal) * 64,
                           static_cast<double>(std::numeric_limits<dReal>::min()),
                           1e-30,
                           1e-6,
                           1e6,
                           1e12,
                           1e30,
                           largest / 1e4};
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {40, 900}) {
      for (const double scale : scales) {
        for (const double offset : {0.0, 1e3, -1e9, 1e17}) {
          const Space space(configuration);
          World world(space);
          for (const Box& box : denseCube(n, 10)) {
            Bounds bounds;
            for (int i = 0; i < 6; ++i) {
              const double at = (i % 2 ? box.high : box.low)[i / 2] + offset;
              // Far from the origin the largest scale leaves the type's range: infinity is right.
              const double value = at * scale;
              bounds[i] = value > largest    ? kInfinity
                          : value < -largest ? -kInfinity
                                             : static_cast<dReal>(value);
            }
            world.take(createUserBox(space, bounds));
          }
          INFO(configuration.name << ", " << n << " geoms, scale " << scale << ", offset "
                                  << offset);
          REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
        }
      }
    }
  }
}

TEST_CASE("Infinite on one side or axis, a geom pairs with all that it reaches", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int which : {1, 2, 3}) {  // low, high, both
        const Space space(configuration);
        World world(space);
        world.addBoxes(denseCube(1000, 11));
        Bounds bounds = {4, 5, 4, 5, 4, 5};
        if (which & 1) bounds[2 * axis] = -kInfinity;
        if (which & 2) bounds[2 * axis + 1] = kInfinity;
        world.take(createUserBox(space, bounds));
        INFO(configuration.name << ", axis " << axis << ", side " << which);
        const Pairs got = collide(space);
        CHECK(difference(got, expectedPairs(world.geoms())) == "");
        CHECK(statsOf(space).invalid == 0);
        std::size_t of_it = 0;
        for (const Pair& pair : got) of_it += pair.second == 1000;
        CHECK(of_it > 10);
      }
    }
  }
}

TEST_CASE("An inverted box pairs with what spans its gap, as the formula has it", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.take(createUserBox(space, {2, 1, 0, 1, 0, 1}));
    world.take(createUserBox(space, {0, 3, 0, 1, 0, 1}));           // spans
    world.take(createUserBox(space, {0, dReal(1.5), 0, 1, 0, 1}));  // does not
    world.take(createUserBox(space, {1, 2, 0, 1, 0, 1}));           // just does
    world.take(createUserBox(space, {2, 1, 0, 1, 0, 1}));           // inverted too
    world.take(createUserBox(space, {kInfinity, -kInfinity, 0, 1, 0, 1}));
    world.take(createUserBox(space, {-kInfinity, kInfinity, 0, 1, 0, 1}));
    const Pairs expected = {{0, 1}, {0, 3}, {0, 6}, {1, 2}, {1, 3}, {1, 4}, {1, 6},
                            {2, 3}, {2, 6}, {3, 4}, {3, 6}, {4, 6}, {5, 6}};
    INFO(configuration.name);
    CHECK(difference(collide(space), expected) == "");
    // Among others, far from where all-pairs tests would be used.
    world.addBoxes(denseCube(1500, 12));
    CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
  }
}

TEST_CASE("Geoms that cross the world in every frame give exactly the expected pairs",
          "[contract]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    world.addBoxes(denseCube(900, 13));
    Random random(seedOr(14));
    for (const double reach : {1.0, 1e3, 1e9, 1e25, 2.0}) {
      for (const dGeomID geom : world.geoms()) {
        dGeomSetPosition(geom, static_cast<dReal>(random.between(-reach, reach)),
                         static_cast<dReal>(random.between(-2, 2)),
                         static_cast<dReal>(random.between(-2, 2)));
      }
      INFO(configuration.name << ", reach " << reach);
      REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
    }
  }
}

TEST_CASE("An empty sub-space is never reported, whatever is at the origin", "[contract]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {4, 100, 1500}) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(n - 3, 15));
      world.take(dCreateSphere(space, 1));  // around the origin
      world.take(dCreatePlane(space, 1, 1, 1, 0));
      const dSpaceID sub_space = dHashSpaceCreate(space);
      world.take(asGeom(sub_space));
      INFO(configuration.name << ", " << n << " geoms");
      const auto pairsOfSubSpace = [&] {
        const Pairs got = collide(space);
        REQUIRE(difference(got, expectedPairs(world.geoms())) == "");
        std::size_t count = 0;
        for (const Pair& pair : got) {
          count +=
              pair.first == number(asGeom(sub_space)) || pair.second == number(asGeom(sub_space));
        }
        return count;
      };
      CHECK(pairsOfSubSpace() == 0);
      const dGeomID inside = dCreateSphere(sub_space, dReal(0.5));
      CHECK(pairsOfSubSpace() >= 2);
      dGeomSetPosition(inside, -50, -50, -50);
      CHECK(pairsOfSubSpace() == 1);  // the plane
      dGeomDestroy(inside);
      CHECK(pairsOfSubSpace() == 0);
      const dGeomID again = dCreateSphere(sub_space, dReal(0.5));
      CHECK(pairsOfSubSpace() >= 2);
      dSpaceRemove(sub_space, again);
      CHECK(pairsOfSubSpace() == 0);
      dGeomDestroy(again);
    }
  }
}

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
