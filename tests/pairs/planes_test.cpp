// Planes: as ODE has them, with every geom, and culled, with those that may touch.
#include <cmath>
#include <limits>

#include "support/random.h"
#include "support/rules_oracle.h"
#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr std::size_t kProbeNumber = 1000000;

// A turned geom of one of ODE's classes, of any size, anywhere.
dGeomID createAnyhow(dSpaceID space, std::size_t kind, Random& random) {
  const double reach = std::pow(10.0, random.between(-6, 8));
  const auto length = [&] { return static_cast<dReal>(std::pow(10.0, random.between(-3, 3))); };
  const auto place = [&] { return static_cast<dReal>(reach * random.gauss()); };
  const dGeomID geom = kind == 0   ? dCreateBox(space, length(), length(), length())
                       : kind == 1 ? dCreateSphere(space, length())
                       : kind == 2 ? dCreateCapsule(space, length(), length())
                                   : dCreateCylinder(space, length(), length());
  dGeomSetPosition(geom, place(), place(), place());
  if (random.chance(0.7)) {
    dMatrix3 rotation;
    dRFromEulerAngles(rotation, static_cast<dReal>(random.gauss()),
                      static_cast<dReal>(random.gauss()), static_cast<dReal>(random.gauss()));
    dGeomSetRotation(geom, rotation);
  }
  return geom;
}

// A plane through the corner of the geom's AABB that is nearest to it, a few steps more or less.
dGeomID createPlaneAt(dSpaceID space, dGeomID geom, Random& random) {
  const Bounds bounds = boundsOf(geom);
  const dReal normal[] = {static_cast<dReal>(random.gauss()),
                          random.chance(0.3) ? 0 : static_cast<dReal>(random.gauss()),
                          random.chance(0.3) ? 0 : static_cast<dReal>(random.gauss())};
  const dGeomID plane = dCreatePlane(space, normal[0], normal[1], normal[2], 0);
  dVector4 unit;
  dGeomPlaneGetParams(plane, unit);
  long double distance = 0, size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    distance += static_cast<long double>(unit[axis]) * bounds[2 * axis + (unit[axis] < 0)];
    size += std::fabs(static_cast<long double>(unit[axis]) * bounds[2 * axis]);
  }
  distance += size * std::numeric_limits<dReal>::epsilon() * random.between(-1, 1) *
              std::pow(10.0, random.between(-1, 3));
  dGeomPlaneSetParams(plane, unit[0], unit[1], unit[2], static_cast<dReal>(distance));
  return plane;
}

}  // namespace

TEST_CASE("No pair is culled for which dCollide finds a contact", "[planes]") {
  const int runs = scaled(3000);
  std::size_t touching = 0, culled = 0;
  for (int run = 0; run < runs; ++run) {
    const std::uint64_t seed = seedOr(221, run);
    Random random(seed);
    const Space space;
    dParallelSAPSpaceSetCullPlanes(space, 1);
    const dGeomID geom = createAnyhow(space, random.below(4), random);
    const dGeomID plane = createPlaneAt(space, geom, random);

    dContactGeom contact[4];
    const bool touches = dCollide(geom, plane, 4, contact, sizeof contact[0]) > 0;
    touching += touches;
    const bool reported = !collide(space).empty();
    dParallelSAPSpaceSetCullPlanes(space, 0);
    const bool is_pair = !collide(space).empty();
    culled += is_pair && !reported;
    INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    // (Rounding may part the boxes of a plane along an axis and a geom that dCollide lets touch.)
    REQUIRE((reported || !is_pair || !touches));
    dGeomDestroy(geom);
    dGeomDestroy(plane);
  }
  CHECK(touching > 0);
  CHECK(culled > 0);
}

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
