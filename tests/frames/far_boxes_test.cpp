// Boxes so far from the origin that floats are coarse for them, among others.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

const Configuration on_cpu = {dParallelSAPBackendCPU, dParallelSAPMethodAuto, "auto"};
constexpr std::size_t n = 3000;

std::size_t keptWhileAllTrembles(dSpaceID space, World& world) {
  std::size_t kept = 0;
  for (int frame = 0; frame < 20; ++frame) {
    world.jitter(0.001, 100 + frame);
    (void)collide(space);
    kept += statsOf(space).candidates_kept > 0;
  }
  return kept;
}

}  // namespace

TEST_CASE("Geoms that have fallen out of the scene one by one do not slow the others down",
          "[far_boxes]") {
  const Space space(on_cpu);
  World world(space);
  world.addBoxes(denseCube(n, 80));
  for (std::size_t i = 0; i < n / 15; ++i)
    dGeomSetPosition(world.geoms()[i * 15], 1, 2, -1e9 - dReal(1e6) * dReal(i));
  CHECK(keptWhileAllTrembles(space, world) > 10);
}

TEST_CASE("Geoms that lie together far out are not tested in vain", "[far_boxes]") {
  if (sizeof(dReal) == sizeof(float)) return;  // there they do overlap
  for (const std::size_t far_ones : {n / 15, n}) {
    const Space space(on_cpu);
    World world(space);
    world.addBoxes(denseCube(n, 81));
    for (std::size_t i = 0; i < far_ones; ++i) {
      const dGeomID geom = world.geoms()[i];
      const dReal* const place = dGeomGetPosition(geom);
      dGeomSetPosition(geom, place[0] + dReal(1e9), place[1], place[2] + dReal(1e9));
    }
    const Pairs pairs = collide(space);
    INFO(far_ones << " geoms far out, " << pairs.size() << " pairs");
    CHECK(statsOf(space).candidates < pairs.size() + n / 2);
  }
}

TEST_CASE("A tolerance that floats cannot tell at one geom's place has no effect until it is back",
          "[far_boxes]") {
  const Space exact(on_cpu), tolerant(on_cpu);
  World one(exact), two(tolerant);
  World* const worlds[] = {&one, &two};
  for (World* const world : worlds) world->addBoxes(denseCube(n, 82));
  dParallelSAPSpaceSetTolerance(tolerant, dReal(0.1));
  const auto extraPairs = [&](std::uint64_t seed) {
    for (World* const world : worlds) world->jitter(0.001, seed);
    const Pairs wanted = collide(exact), found = collide(tolerant);
    CHECK(std::includes(found.begin(), found.end(), wanted.begin(), wanted.end()));
    return found.size() - wanted.size();
  };
  CHECK(extraPairs(1) > 0);
  for (World* const world : worlds) dGeomSetPosition(world->geoms()[7], 1e5, 0, 0);
  CHECK(extraPairs(2) == 0);
  CHECK(keptWhileAllTrembles(tolerant, two) > 10);
  for (World* const world : worlds) dGeomSetPosition(world->geoms()[7], 1, 0, 0);
  for (int frame = 0; frame < 20; ++frame) one.jitter(0.001, 100 + frame);
  CHECK(extraPairs(3) > 0);
}
