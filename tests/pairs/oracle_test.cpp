// The oracle itself, held against ODE's own dSimpleSpace.
#include "support/oracle.h"

#include <limits>

#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

struct SimpleSpace {
  dSpaceID id = dSimpleSpaceCreate(nullptr);
  ~SimpleSpace() { dSpaceDestroy(id); }
};

}  // namespace

TEST_CASE("The oracle's pairs are those of dSimpleSpace in every scene", "[oracle]") {
  for (const WorldScene& scene : worldScenes()) {
    const std::uint64_t seed = seedOr(1);
    SimpleSpace space;
    World world(space.id);
    scene.populate(world, 250, seed);
    INFO(scene.name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    REQUIRE(world.geoms().size() == 250);
    const Pairs expected = expectedPairs(world.geoms());
    CHECK(expected.size() > 5);  // 25 on average in the emptiest
    CHECK(difference(asSet(collide(space.id)), expected) == "");
  }
}

TEST_CASE("The oracle keeps out what cannot take part", "[oracle]") {
  SimpleSpace space;
  World world(space.id);
  const dReal nan = std::numeric_limits<dReal>::quiet_NaN(), half = dReal(0.5);
  world.take(dCreateBox(space.id, 1, 1, 1));
  world.take(dCreateBox(space.id, 1, 0, 1));
  world.take(dCreateSphere(space.id, 0));
  world.take(dCreateCylinder(space.id, 1, 0));
  world.take(dCreateCapsule(space.id, 0, 1));
  const dGeomID short_capsule = world.take(dCreateCapsule(space.id, 1, 0));
  world.take(createUserBox(space.id, {-half, half, nan, half, -half, half}));
  dGeomDisable(world.take(dCreateBox(space.id, 1, 1, 1)));
  world.take(asGeom(dSimpleSpaceCreate(space.id)));
  CHECK(difference(expectedPairs(world.geoms()), {{0, number(short_capsule)}}) == "");
}
