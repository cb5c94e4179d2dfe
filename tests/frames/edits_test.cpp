// Whatever a program does to a space and its geoms, it sees what it would see with ODE's spaces.
#include "fuzz/driver.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/same_addresses.h"

using namespace sap_test;

namespace {

void editAndCheck(const Configuration& configuration, std::uint64_t seed, std::size_t most_geoms) {
  Decisions decisions(seed);
  Driver driver(decisions, most_geoms, &configuration);
  for (int i = 0; i < 200 && driver.problem().empty(); ++i) driver.step();
  if (driver.problem().empty()) driver.finish();
  INFO(configuration.name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  REQUIRE(driver.problem() == "");
}

}  // namespace

TEST_CASE("Spaces show the oracle's pairs, geoms and answers after any edits", "[edits]") {
  for (const Configuration& configuration : configurations()) {
    for (int round = 0; round < scaled(400); ++round)
      editAndCheck(configuration, seedOr(100, round), 40);
    for (int round = 0; round < scaled(40); ++round)
      editAndCheck(configuration, seedOr(200, round), 250);
    for (int round = 0; round < scaled(10); ++round)
      editAndCheck(configuration, seedOr(300, round), 900);
  }
}

TEST_CASE("A geom that came within a call is not reported, whatever geoms had its address",
          "[edits]") {
  struct Scene {
    const Space outer;
    const dSpaceID inner = dParallelSAPSpaceCreate(outer), stock = dSimpleSpaceCreate(inner);
    dGeomID geoms[2] = {dCreateSphere(stock, 1), dCreateSphere(stock, 1)};
    const dGeomID geom = dCreateSphere(nullptr, 1);
    int replacements = 0, reports = 0;
    bool same_address = false;

    void overlaps(dSpaceID space, dParallelSAPOverlapCallback* callback) {
      dParallelSAPProbe probe = {};
      probe.geom = geom;
      dParallelSAPSpaceOverlaps(space, &probe, 1, sizeof probe, 1, this, callback);
    }
    // Calls of the outer space see each geom that comes; the call of the inner one sees the last.
    static void replace(void* data, size_t, dGeomID reported, const dContactGeom*, int) {
      Scene& scene = *static_cast<Scene*>(data);
      if (++scene.reports > 1) return;
      dGeomID& other = scene.geoms[scene.geoms[0] == reported];
      const dGeomID before = other;
      dGeomDestroy(dCreateSphere(scene.stock, 1));
      for (int i = 0; i < scene.replacements; ++i) {
        dGeomDestroy(other);
        other = dCreateSphere(scene.stock, 1);
        scene.overlaps(scene.outer, [](void*, size_t, dGeomID, const dContactGeom*, int) {});
      }
      scene.same_address = other == before;
    }
  };
  const SameAddresses same_addresses;
  for (int replacements = 1; replacements < 300; ++replacements) {
    Scene scene;
    scene.replacements = replacements;
    scene.overlaps(scene.inner, Scene::replace);
    INFO(replacements);
    CHECK(scene.same_address);
    CHECK(scene.reports == 1);
    dGeomDestroy(scene.geom);
  }
}
