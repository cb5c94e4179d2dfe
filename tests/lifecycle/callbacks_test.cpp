// Callbacks that destroy, remove, add and move geoms of the space that calls them.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <vector>

#include "fuzz/driver.h"
#include "support/bounds.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/recorder.h"

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
  struct Report {
    std::vector<dGeomID> spheres;
    std::size_t earlier = 0, distance = 0, pairs = 0, wrong = 0, destroyed_at = 0, destroyed = 0;

    // Goes on to the next pair of those that are still there.
    void next() {
      do {
        if (++distance > reach) {
          ++earlier;
          distance = 1;
        }
      } while (earlier < geoms &&
               (earlier + distance >= geoms || !spheres[earlier] || !spheres[earlier + distance]));
    }
  } report;
  const Space space;
  dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
  dParallelSAPSpaceSetNumThreads(space, 8);
  for (std::size_t i = 0; i < geoms; ++i) {
    report.spheres.push_back(dCreateSphere(space, real(reach * 0.5 + 0.1)));
    dGeomSetPosition(report.spheres[i], real(i), 0, 0);
  }
  for (const std::size_t at : {std::size_t{0}, least_part + 1000, std::size_t{70000}}) {
    INFO("geoms leave at pair " << at);
    report.earlier = report.distance = report.pairs = 0;
    report.next();
    report.destroyed_at = at;
    dSpaceCollide(space, &report, [](void* data, dGeomID o1, dGeomID o2) {
      Report& self = *static_cast<Report*>(data);
      self.wrong +=
          o1 != self.spheres[self.earlier] || o2 != self.spheres[self.earlier + self.distance];
      if (++self.pairs == self.destroyed_at)
        for (dGeomID* geom : {&self.spheres[self.earlier + 2], &self.spheres[geoms - 3]})
          if (*geom) {
            dGeomDestroy(*geom);
            *geom = nullptr;
            ++self.destroyed;
          }
      self.next();
    });
    CHECK(report.earlier == geoms);
    CHECK(report.wrong == 0);
  }
  CHECK(report.pairs > least_part);
  CHECK(report.destroyed == 3);
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
