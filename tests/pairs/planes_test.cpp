// Planes: as ODE has them, with every geom, and culled, with those that may touch.
#include "support/rules_oracle.h"
#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr std::size_t kProbeNumber = 1000000;

}  // namespace

TEST_CASE("Bounds and planes of every kind are culled by the definition, in queries too",
          "[planes]") {
  const dReal most = std::numeric_limits<dReal>::max();
  const dReal values[] = {-kInfinity, -most, -most / 8,   dReal(-1e30), -1,   dReal(-1e-30),
                          0,          1,     dReal(1e30), most / 8,     most, kInfinity};
  for (int run = 0; run < scaled(20); ++run)
    for (const Configuration& configuration : configurations()) {
      const std::uint64_t seed = seedOr(231, run);
      INFO(configuration.name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      Random random(seed);
      const bool mixed = random.chance(0.5);
      const auto createBox = [&](dSpaceID space) {
        Bounds bounds;
        for (dReal& bound : bounds)
          bound =
              mixed || random.chance(0.1) ? values[random.below(12)] : real(random.between(-3, 3));
        return createUserBox(space, bounds);
      };
      const auto createPlane = [&](dSpaceID space) {
        // Normals with parts so small that floats lose them.
        const dReal parts[] = {0, dReal(1e-300), dReal(1e-46), dReal(1e-20), 1, -1, 3};
        const dReal x = parts[random.below(7)], y = parts[random.below(7)];
        return dCreatePlane(space, x, y, parts[4 + random.below(3)], values[1 + random.below(10)]);
      };
      for (const std::size_t n : {20, 120, 400}) {
        const Space space(configuration);
        dParallelSAPSpaceSetCullPlanes(space, 1);
        dParallelSAPSpaceSetTolerance(space, dReal(random.chance(0.5) ? 0.01 : 0));
        World world(space);
        for (std::size_t i = 0; i < n; ++i) {
          world.take(createBox(space));
          if (i % 8 == 0) world.take(createPlane(space));
        }
        for (const int cull : {1, 1, 0, 1}) {
          dParallelSAPSpaceSetCullPlanes(space, cull);
          REQUIRE(wrongByRules(Rules::of(space), world.geoms(), collide(space)) == "");
        }
        for (int query = 0; query < 30; ++query) {
          const dGeomID probe = query % 3 ? createBox(nullptr) : createPlane(nullptr);
          setNumber(probe, kProbeNumber);
          const Pairs got = collide2(space, probe);
          Pairs all;
          for (const dGeomID geom : world.geoms())
            if (mayTouch(geom, probe)) all.emplace_back(number(geom), kProbeNumber);
          const Pairs expected = withoutCulled(all, got, [&](std::size_t of) {
            return of == kProbeNumber ? probe : world.geoms()[of];
          });
          dGeomDestroy(probe);
          REQUIRE(difference(got, expected) == "");
        }
      }
    }
}
