// Classes that are declared to have no AABBTest. These tests see ODE's private headers.
#include <cstdlib>
#include <thread>

#include "space/geoms/geom_tests.h"
#include "support/teams.h"
#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;
using ode_parallel_sap::untested_classes;

namespace {

using Calls = std::vector<std::pair<dGeomID, dGeomID>>;
Calls calls;
const std::thread::id caller = std::this_thread::get_id();
bool agrees = true;

int test(dGeomID self, dGeomID other, dReal[6]) {
  calls.push_back({self, other});
  if (caller != std::this_thread::get_id()) std::abort();
  return agrees;
}

enum Kind { kSphere, kTested, kPlain };

// Unit cubes of these classes and spheres in turn, thrown into a cube, more than a small scene. No
// class is declared.
void fill(World& world, const std::vector<Kind>& kinds) {
  untested_classes = 0;
  const dReal half = dReal(0.5);
  const Bounds bounds = {-half, half, -half, half, -half, half};
  Random random(seedOr(311));
  const auto place = [&] { return real(random.between(0, 7)); };
  for (std::size_t i = 0; i < 400; ++i) {
    const Kind kind = kinds[i % kinds.size()];
    const dGeomID geom = world.take(kind == kSphere   ? dCreateSphere(nullptr, half)
                                    : kind == kTested ? createUserBox(nullptr, bounds, true, test)
                                                      : createUserBoxWithoutTest(nullptr, bounds));
    if (kind == kPlain) userBoxData(geom).relative = true;
    dGeomSetPosition(geom, place(), place(), place());
  }
}

void declareClassOf(dGeomID geom) {
  dParallelSAPClassHasNoAABBTest(dGeomGetClass(geom));
}

// Those that are owed if all tests agree.
Pairs pairsOf(const World& world) {
  agrees = true;
  const Pairs pairs = expectedPairs(world.geoms());
  calls.clear();
  REQUIRE(pairs.size() > 400);
  return pairs;
}

}  // namespace

TEST_CASE("No AABBTest of a class is called from the collide after its declaration on") {
  for (const bool others : {false, true}) {
    const Space space;
    World world(space);
    fill(world, others ? std::vector<Kind>{kTested, kSphere} : std::vector<Kind>{kTested});
    const Pairs expected = pairsOf(world);
    agrees = false;
    CHECK(collide(space).empty() == !others);
    CHECK(!calls.empty());
    calls.clear();
    declareClassOf(world.geoms()[0]);
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
  const ScopedGrain grain(1);
  const auto shared = [] { return timesShared()["filter: verified pairs"]; };
  for (const Kind kind : {kPlain, kTested}) {
    const Space space;
    dParallelSAPSpaceSetNumThreads(space, 3);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
    dParallelSAPSpaceSetSkipStatic(space, 1);
    World world(space);
    fill(world, {kind});
    for (std::size_t i = 0; i < world.geoms().size(); i += 2) world.giveBody(world.geoms()[i]);
    if (kind == kPlain) declareClassOf(world.geoms()[0]);
    agrees = true;
    const auto before = shared();
    CHECK(!collide(space).empty());
    CHECK((shared() > before) == (kind == kPlain));
  }
}

TEST_CASE("An AABBTest gets the same pairs in the same order, whatever is declared of others") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    fill(world, {kTested, kPlain, kSphere});
    INFO(configuration.name);
    const Pairs owed = pairsOf(world), expected = collide(space);
    const Calls expected_calls = std::exchange(calls, {});
    REQUIRE(difference(expected, owed) == "");
    REQUIRE(expected_calls.size() > 200);
    declareClassOf(world.geoms()[1]);
    for (const bool moving : {true, false}) {
      if (moving) world.jitter(0, 1);
      CHECK(difference(collide(space), expected) == "");
      CHECK(std::exchange(calls, {}) == expected_calls);
    }
  }
}
