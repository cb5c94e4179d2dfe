// Classes that are declared to have no AABBTest. These tests see ODE's private headers, and have
// all of its few classes to themselves.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdlib>
#include <thread>
#include <utility>
#include <vector>

#include "space/geoms/geom_tests.h"
#include "support/bounds.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/teams.h"

using namespace sap_test;
using ode_parallel_sap::untested_classes;

namespace {

using Calls = std::vector<std::pair<dGeomID, dGeomID>>;
Calls calls;
std::thread::id caller;

dColliderFn* noCollider(int) {
  return nullptr;
}

// A unit cube.
void bounds(dGeomID geom, dReal aabb[6]) {
  const dReal* const at = dGeomGetPosition(geom);
  for (int i = 0; i < 6; ++i) aabb[i] = at[i / 2] + (i % 2 ? dReal(0.5) : dReal(-0.5));
}

int agree(dGeomID self, dGeomID other, dReal[6]) {
  calls.push_back({self, other});
  if (caller != std::this_thread::get_id()) std::abort();
  return 1;
}

int refuse(dGeomID self, dGeomID other, dReal aabb[6]) {
  return agree(self, other, aabb) - 1;
}

// ODE's classes from its beginning on, of which there may be four.
class Classes {
 public:
  Classes() { reopen(); }
  ~Classes() { reopen(); }
  Classes(const Classes&) = delete;
  Classes& operator=(const Classes&) = delete;

  int create(dAABBTestFn* test) const {
    dGeomClass description = {};
    description.collider = noCollider;
    description.aabb = bounds;
    description.aabb_test = test;
    return dCreateGeomClass(&description);
  }

 private:
  void reopen() {
    dCloseODE();
    dInitODE2(0);
    dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
    calls.clear();
    caller = std::this_thread::get_id();
    untested_classes = 0;
  }
};

// More than a small scene.
constexpr std::size_t kGeoms = 400;

// Geoms of these classes in turn, thrown into a cube; class 0: spheres.
void fill(World& world, dSpaceID space, const std::vector<int>& classes) {
  Random random(seedOr(311));
  for (std::size_t i = 0; i < kGeoms; ++i) {
    const int of = classes[i % classes.size()];
    const dGeomID geom = of ? dCreateGeom(of) : dCreateSphere(nullptr, dReal(0.5));
    dSpaceAdd(space, geom);
    world.take(geom);
    const auto place = [&] { return static_cast<dReal>(random.between(0, 7)); };
    dGeomSetPosition(geom, place(), place(), place());
  }
}

// Those whose bounds touch, and no AABBTest of the program's refuses. (The tests' oracle has
// classes of its own.)
Pairs expectedOf(const World& world, int refusing = 0) {
  Pairs pairs;
  const std::vector<dGeomID>& geoms = world.geoms();
  const auto refuses = [&](dGeomID geom) { return refusing && dGeomGetClass(geom) == refusing; };
  for (std::size_t i = 0; i < geoms.size(); ++i)
    for (std::size_t j = i + 1; j < geoms.size(); ++j) {
      if (!refuses(geoms[i]) && !refuses(geoms[j]) &&
          overlap(boundsOf(geoms[i]), boundsOf(geoms[j])))
        pairs.push_back({i, j});
    }
  return pairs;
}

}  // namespace

TEST_CASE("No AABBTest of a class is called from the collide after its declaration on") {
  const Classes classes;
  for (const bool others : {false, true}) {
    untested_classes = 0;
    const int refusing = others ? classes.create(refuse) : dFirstUserClass;
    if (!others) REQUIRE(classes.create(refuse) == refusing);
    const Space space;
    World world(space);
    fill(world, space, others ? std::vector<int>{refusing, 0} : std::vector<int>{refusing});
    const Pairs expected = expectedOf(world);
    REQUIRE(expected.size() > 400);
    CHECK(collide(space).empty() == !others);
    CHECK(!calls.empty());
    calls.clear();
    dParallelSAPClassHasNoAABBTest(refusing);
    for (const bool moving : {false, true}) {
      if (moving) world.jitter(0, 1);
      CHECK(difference(collide(space), expected) == "");
      CHECK(calls.empty());
    }
  }
}

TEST_CASE("A class that is none of the user's cannot be declared") {
  untested_classes = 0;
  throwOdeErrors();
  for (const int of : {-1, static_cast<int>(dBoxClass), dLastUserClass + 1})
    if (odeHasAssertions())
      CHECK_THROWS_AS(dParallelSAPClassHasNoAABBTest(of), OdeAssertion);
    else
      dParallelSAPClassHasNoAABBTest(of);
  CHECK(untested_classes == 0);
}

TEST_CASE("All threads verify pairs, unless a class may have an AABBTest") {
  const Classes classes;
  const int tested = classes.create(agree), plain = classes.create(nullptr);
  dParallelSAPClassHasNoAABBTest(plain);
  const ScopedGrain grain(1);
  const auto shared = [] { return timesShared()["filter: verified pairs"]; };
  for (const int of : {plain, tested}) {
    const Space space;
    dParallelSAPSpaceSetNumThreads(space, 3);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
    dParallelSAPSpaceSetSkipStatic(space, 1);
    World world(space);
    fill(world, space, {of});
    for (std::size_t i = 0; i < kGeoms; i += 2) world.giveBody(world.geoms()[i]);
    const auto before = shared();
    CHECK(!collide(space).empty());
    CHECK((shared() > before) == (of != tested));
  }
}

TEST_CASE("An AABBTest gets the same pairs in the same order, whatever is declared of others") {
  const Classes classes;
  const int tested = classes.create(agree), plain = classes.create(nullptr);
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    fill(world, space, {tested, plain, 0});
    INFO(configuration.name);
    untested_classes = 0;
    const Pairs expected = collide(space);
    const Calls expected_calls = std::exchange(calls, {});
    REQUIRE(difference(expected, expectedOf(world)) == "");
    REQUIRE(expected_calls.size() > 200);
    dParallelSAPClassHasNoAABBTest(plain);
    for (const bool moving : {true, false}) {
      if (moving) world.jitter(0, 1);
      CHECK(difference(collide(space), expected) == "");
      CHECK(std::exchange(calls, {}) == expected_calls);
    }
  }
}
