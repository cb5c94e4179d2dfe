// dSpaceCollide2 of geoms and spaces against a space: as many queries as it takes for the space to
// keep a structure for them, while geoms move, come, go and change in every way.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/moving_scene.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr std::size_t kProbeNumber = 1000000;
constexpr dReal kInfinity = std::numeric_limits<dReal>::infinity();

// What dSpaceCollide2 (space, probe) owes for the space's geoms, in the order in which they were
// last added. Asks for their bounds, so the space goes first.
Pairs expectedOf(const std::vector<dGeomID>& in_add_order, dGeomID probe) {
  Pairs expected;
  for (const dGeomID geom : in_add_order)
    if (takesPart(geom) && mayTouch(geom, probe))
      expected.emplace_back(number(geom), number(probe));
  return expected;
}

// A geom in no space.
class Probe {
 public:
  explicit Probe(dGeomID geom) : geom_(geom) { setNumber(geom_, kProbeNumber); }
  ~Probe() { dGeomDestroy(geom_); }
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;
  operator dGeomID() const { return geom_; }

 private:
  dGeomID geom_;
};

// The geoms of one space, in the order in which they were last added.
std::string wrongAnswer(dSpaceID space, const std::vector<dGeomID>& geoms, dGeomID probe) {
  const Pairs got = collide2(space, probe);
  return difference(got, expectedOf(geoms, probe));
}

// A place near some geom, so that there is something to find.
void putNear(dGeomID probe, const std::vector<dGeomID>& geoms, Random& random) {
  dReal bounds[6];
  dGeomGetAABB(geoms[random.below(geoms.size())], bounds);
  dReal at[3];
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = (bounds[2 * axis] + bounds[2 * axis + 1]) / 2 + static_cast<dReal>(random.gauss());
    if (!std::isfinite(at[axis])) at[axis] = static_cast<dReal>(random.gauss());
  }
  dGeomSetPosition(probe, at[0], at[1], at[2]);
}

void ignore(void*, dGeomID, dGeomID) {}

}  // namespace

TEST_CASE("Queries report what the oracle expects, in order, in every scene and as it moves",
          "[queries]") {
  const std::uint64_t seed = seedOr(101);
  for (const WorldScene& scene : worldScenes())
    for (const std::size_t n : {1, 95, 96, 400, 3000}) {
      if (n > scene.most) continue;
      INFO(scene.name << ", " << n << " geoms, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      const Space space;
      World world(space);
      scene.populate(world, n, seed);
      Random random(seed);
      const Probe box(dCreateBox(nullptr, 1, 2, 3)), ray(dCreateRay(nullptr, 5));
      // Still, trembling, and flung through the world.
      for (const double distance : {0.0, 0.01, 30.0}) {
        for (int frame = 0; frame < 3; ++frame) {
          if (distance > 0) world.jitter(distance, random.bits());
          for (int i = 0; i < 30; ++i) {
            const dGeomID probe = i % 2 ? box : ray;
            putNear(probe, world.geoms(), random);
            REQUIRE(wrongAnswer(space, world.geoms(), probe) == "");
          }
        }
      }
    }
}

TEST_CASE("Queries see every change to a space, whatever came before", "[queries]") {
  const int runs = scaled(12);
  for (int run = 0; run < runs; ++run) {
    const std::uint64_t seed = seedOr(110, run);
    INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    MovingScene scene(configurations()[0], 150, seed);
    Random random(seed);
    const Probe probe(dCreateSphere(nullptr, 1));
    for (int step = 0; step < 400; ++step) {
      CAPTURE(step);
      scene.edit();
      if (random.chance(0.1)) scene.moveSome(0.5);
      if (random.chance(0.1)) (void)collide(scene.space());
      for (std::size_t queries = random.below(4) == 0 ? 25 : random.below(3); queries > 0;
           --queries) {
        putNear(probe, scene.order(), random);
        REQUIRE(wrongAnswer(scene.space(), scene.order(), probe) == "");
      }
    }
  }
}

TEST_CASE("Queries follow the formula for bounds of every kind, on both sides", "[queries]") {
  const dReal nan = std::numeric_limits<dReal>::quiet_NaN();
  const dReal most = std::numeric_limits<dReal>::max();
  const dReal tiny = std::numeric_limits<dReal>::denorm_min();
  const dReal values[] = {-kInfinity, -most, -1, -tiny, 0, tiny, 1, 2, most, kInfinity, nan};
  for (int run = 0; run < scaled(10); ++run) {
    const std::uint64_t seed = seedOr(130, run);
    INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    Random random(seed);
    const double place = run % 2 ? 1e9 : 0;  // where floats tell no box from another
    const auto anyBounds = [&](double strange) {
      Bounds bounds;
      for (int i = 0; i < 6; ++i)
        bounds[i] = random.chance(strange)
                        ? values[random.below(11)]
                        : static_cast<dReal>(place + random.between(0, 3) + i % 2);
      return bounds;
    };
    const Space space;
    World world(space);
    for (int i = 0; i < 200; ++i) world.take(createUserBox(space, anyBounds(0.1)));
    for (int frame = 0; frame < 6; ++frame) {
      for (int i = 0; i < 30; ++i) {
        const Bounds bounds = anyBounds(0.2);
        bool invalid = false;
        for (const dReal bound : bounds) invalid = invalid || std::isnan(bound);
        const Probe probe(createUserBox(nullptr, bounds));
        const Pairs got = collide2(space, probe);
        REQUIRE(difference(got, invalid ? Pairs() : expectedOf(world.geoms(), probe)) == "");
      }
      // NaN appears and heals; one frame little changes, the next one everything.
      for (const dGeomID geom : world.geoms())
        if (random.chance(frame % 2 ? 1 : 0.05)) setUserBounds(geom, anyBounds(0.1));
    }
  }
}

TEST_CASE("Two spaces report the same pairs whichever is asked, and whichever is larger",
          "[queries]") {
  const std::uint64_t seed = seedOr(151);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  const Space few, many;
  World small(few), large(many);
  small.addBoxes(denseCube(300, seed));
  large.addBoxes(denseCube(2500, seed + 1));
  for (const dGeomID geom : small.geoms()) setNumber(geom, kProbeNumber + number(geom));
  for (int frame = 0; frame < 3; ++frame) {
    Pairs expected;
    const Pairs got = collide2(many.geom(), few.geom()), other = collide2(few.geom(), many.geom());
    for (const dGeomID probe : small.geoms())
      for (const Pair& pair : expectedOf(large.geoms(), probe)) expected.push_back(pair);
    CHECK(expected.size() > 500);
    REQUIRE(difference(got, expected) == "");
    for (Pair& pair : expected) std::swap(pair.first, pair.second);
    REQUIRE(difference(other, expected) == "");
    small.jitter(0.5, seed + 2);
    if (frame == 1) large.jitter(0.5, seed + 3);
  }
}

TEST_CASE("A query's callback may throw and ask again", "[queries]") {
  const std::uint64_t seed = seedOr(161);
  const Space space;
  World world(space);
  world.addBoxes(denseCube(1000, seed));
  const Probe probe(dCreateBox(nullptr, 4, 4, 4)), inner(dCreateBox(nullptr, 1, 1, 1));
  dGeomSetPosition(probe, 5, 5, 5);
  dGeomSetPosition(inner, 4, 4, 4);
  for (int i = 0; i < 40; ++i) collide2(space, probe);
  const Pairs expected = expectedOf(world.geoms(), probe);
  const Pairs expected_inside = collide(space), expected_of_inner = collide2(space, inner);
  REQUIRE(expected.size() > 100);

  struct Nest {
    const Space& space;
    dGeomID inner;
    const Pairs &inside, &of_inner;
    Pairs seen;
    std::string problem;
  } nest{space, inner, expected_inside, expected_of_inner, {}, ""};
  dSpaceCollide2(space.geom(), probe, &nest, [](void* data, dGeomID a, dGeomID b) {
    Nest& n = *static_cast<Nest*>(data);
    record(&n.seen, a, b);
    if (n.seen.size() % 16 != 1) return;
    n.problem += difference(collide2(n.space, n.inner), n.of_inner);
    n.problem += difference(collide(n.space), n.inside);
  });
  CHECK(nest.problem == "");
  CHECK(difference(nest.seen, expected) == "");

  for (std::size_t at = 1; at < expected.size(); at += 37) {
    struct Stop {
      std::size_t left;
    } stop{at};
    REQUIRE_THROWS_AS(dSpaceCollide2(space.geom(), probe, &stop,
                                     [](void* data, dGeomID, dGeomID) {
                                       if (--static_cast<Stop*>(data)->left == 0) throw 1;
                                     }),
                      int);
    REQUIRE(difference(collide2(space, probe), expected) == "");
  }
}

TEST_CASE("A ray in the space itself is asked, moved, made and destroyed for every query",
          "[queries]") {
  const std::uint64_t seed = seedOr(171);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  const Space space;
  World world(space);
  world.addBoxes(denseCube(1500, seed));
  Random random(seed);
  const dGeomID own = world.take(dCreateRay(space, 4));
  for (int i = 0; i < 300; ++i) {
    dGeomSetPosition(own, static_cast<dReal>(random.between(0, 10)),
                     static_cast<dReal>(random.between(0, 10)), 5);
    // As in ODE, a geom without body also pairs with itself.
    REQUIRE(wrongAnswer(space, world.geoms(), own) == "");
    const dGeomID passing = dCreateRay(space, 4);
    dGeomSetPosition(passing, 5, 5, static_cast<dReal>(random.between(0, 10)));
    setNumber(passing, kProbeNumber);
    std::vector<dGeomID> all = world.geoms();
    all.push_back(passing);
    const std::string wrong = wrongAnswer(space, all, passing);
    dGeomDestroy(passing);
    REQUIRE(wrong == "");
  }
}

TEST_CASE("A thousand probes of a large space take a small part of dSimpleSpace's time",
          "[queries]") {
  const std::size_t n = 32000;
  const Space space;
  const dSpaceID simple = dSimpleSpaceCreate(nullptr);
  {
    World world(space), twin(simple);
    world.addBoxes(denseCube(n, 1));
    twin.addBoxes(denseCube(n, 1));
    const Probe probe(dCreateBox(nullptr, 1, 1, 1));
    const auto timeOf = [&](dSpaceID asked, int queries) {
      const auto begin = std::chrono::steady_clock::now();
      for (int i = 0; i < queries; ++i) {
        dGeomSetPosition(probe, static_cast<dReal>(i % 30), static_cast<dReal>(i / 30 % 30), 10);
        dSpaceCollide2(asGeom(asked), probe, nullptr, ignore);
      }
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() /
             queries;
    };
    // Measured: 500 times quicker. Less is asked for, as the machine may be busy with other things.
    timeOf(space, 100);
    CHECK(timeOf(space, 1000) * 20 < timeOf(simple, 20));
  }
  dSpaceDestroy(simple);
}

TEST_CASE("A geom that moved before others went and came is found where it is", "[queries]") {
  const Space space;
  World world(space);
  for (int i = 0; i < 200; ++i) {
    const dReal at = static_cast<dReal>(3 * i);
    world.take(createUserBox(space, {at, at + 1, 0, 1, 0, 1}));
  }
  const Probe probe(createUserBox(nullptr, {-10, -9, 0, 1, 0, 1}));
  for (int i = 0; i < 20; ++i) CHECK(collide2(space, probe).empty());
  // The first one and so many others that the space numbers those that are left anew when one more
  // comes; none of the numbers around the moved one's is free before. The tree knows who left.
  const std::vector<dGeomID> all = world.geoms();
  for (std::size_t i = 0; i < 199; ++i) {
    if (i > 0 && i < 99) continue;
    world.remove(all[i]);
    dGeomDestroy(all[i]);
    CHECK(collide2(space, probe).empty());
  }
  const dGeomID moved = all[50];
  setUserBounds(moved, {-10, -9, 0, 1, 0, 1});
  world.take(createUserBox(space, {-20, -19, 0, 1, 0, 1}));
  const Pairs got = collide2(space, probe);
  CHECK(difference(got, {{number(moved), kProbeNumber}}) == "");
}

TEST_CASE("Geoms that are too many for one thread are found where they have moved", "[queries]") {
  const Space space;
  for (int i = 0; i < 20000; ++i)
    dGeomSetPosition(dCreateSphere(space, 1), static_cast<dReal>(3 * i), 0, 0);
  const Probe probe(dCreateSphere(nullptr, 1));
  for (int i = 0; i < 20; ++i) CHECK(collide2(space, probe).size() == 1);
  for (int i = 0; i < 4900; ++i)
    dGeomSetPosition(dSpaceGetGeom(space, i), static_cast<dReal>(3 * i), 100, 0);
  CHECK(collide2(space, probe).empty());
}

// ThreadSanitizer sees it if two threads write the box of one of them.
TEST_CASE("Geoms that moved twice since the last query are found where they are", "[queries]") {
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, 3);
  for (int i = 0; i < 4000; ++i)
    dGeomSetPosition(dCreateSphere(space, 1), static_cast<dReal>(3 * i), 0, 0);
  const Probe probe(dCreateSphere(nullptr, 1));
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 40; ++i) CHECK(collide2(space, probe).size() == 1);
    for (const dReal height : {dReal(0.01), dReal(0)}) {
      for (int i = 0; i < 300; ++i)
        dGeomSetPosition(dSpaceGetGeom(space, i), static_cast<dReal>(3 * i), height, 0);
      dSpaceClean(space);
    }
  }
}
