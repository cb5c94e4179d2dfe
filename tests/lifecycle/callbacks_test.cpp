// Callbacks that destroy, remove, add and move geoms of the space that calls them.
#include "fuzz/driver.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

struct EditedWorld : private Decisions, public Driver {
  EditedWorld(const Configuration* configuration, std::size_t geoms, std::uint64_t seed)
      : Decisions(seed), Driver(*this, geoms, configuration) {
    for (int i = 0; i < 3; ++i) createSpace();
    for (int tries = 0; tries < 200 && alive() < geoms * 3 / 4; ++tries) populate();
    for (int i = 0; i < 8; ++i) step(false);
  }
};

void editInCallbacks(const Configuration* configuration, std::size_t geoms, std::uint64_t seed,
                     bool jumps) {
  INFO((configuration ? configuration->name : "defaults")
       << ", " << geoms << " geoms, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  EditedWorld world(configuration, geoms, seed);
  Random random(seed);
  world.playEditedCalls(random, 14, jumps);
  REQUIRE(world.problem() == "");
}

}  // namespace

TEST_CASE("What leaves within a callback is in no further report, what comes is in later calls",
          "[callbacks]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t geoms : {6, 40, 110, 300, 1000})
      for (int run = 0; run < scaled(geoms > 500 ? 1 : 6); ++run)
        editInCallbacks(&configuration, geoms, seedOr(8100, run), false);
}

TEST_CASE("The same holds after callbacks were left by longjmp", "[callbacks]") {
  for (const std::size_t geoms : {6, 40, 110, 300})
    for (int run = 0; run < scaled(20); ++run)
      editInCallbacks(nullptr, geoms, seedOr(8200, run), true);
}

TEST_CASE("Threads look up the geoms of many pairs in parts, between which geoms leave",
          "[callbacks][long]") {
  constexpr std::size_t geoms = (1 << 18) + 100, reach = 5, least_part = 1 << 20;
  const Space space(on_cpu);
  dParallelSAPSpaceSetNumThreads(space, 8);
  std::vector<dGeomID> spheres;
  for (std::size_t i = 0; i < geoms; ++i) {
    spheres.push_back(dCreateSphere(space, real(reach * 0.5 + 0.1)));
    dGeomSetPosition(spheres[i], real(i), 0, 0);
  }
  std::size_t pairs = 0, destroyed = 0;
  for (const std::size_t at : {std::size_t{0}, least_part + 1000, std::size_t{70000}}) {
    INFO("geoms leave at pair " << at);
    std::size_t earlier = 0, distance = 0, wrong = 0;
    // Goes on to the next pair of those that are still there.
    const auto next = [&] {
      do {
        earlier += distance == reach;
        distance = distance % reach + 1;
      } while (earlier < geoms &&
               (earlier + distance >= geoms || !spheres[earlier] || !spheres[earlier + distance]));
    };
    pairs = 0;
    next();
    collide(space, [&](dGeomID o1, dGeomID o2) {
      wrong += o1 != spheres[earlier] || o2 != spheres[earlier + distance];
      if (++pairs == at)
        for (dGeomID* geom : {&spheres[earlier + 2], &spheres[geoms - 3]})
          if (*geom) {
            dGeomDestroy(std::exchange(*geom, nullptr));
            ++destroyed;
          }
      next();
    });
    CHECK(earlier == geoms);
    CHECK(wrong == 0);
  }
  CHECK(pairs > least_part);
  CHECK(destroyed == 3);
}

TEST_CASE("dHashSpaceSetLevels on this space changes none of its settings, without assertions too",
          "[callbacks]") {
  const Space space;
  const auto settings = [&] {
    return std::vector<int>{dParallelSAPSpaceGetBackend(space), dParallelSAPSpaceGetMethod(space),
                            dParallelSAPSpaceGetNumThreads(space),
                            dParallelSAPSpaceGetNumDevices(space),
                            dParallelSAPSpaceGetCullPlanes(space)};
  };
  const std::vector<int> before = settings();
  int low = 0, high = 0;
  if (odeHasAssertions()) {
    CHECK_THROWS_AS(dHashSpaceSetLevels(space, -10, 7), OdeAssertion);
  } else {
    dHashSpaceGetLevels(space, &low, &high);
    CHECK((low == -3 && high == 10));
    dHashSpaceSetLevels(space, -10, 7);
    dHashSpaceGetLevels(space, &low, &high);
    CHECK((low == -10 && high == 7));
  }
  CHECK(settings() == before);
}
