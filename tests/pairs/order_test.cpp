// Pairs come ascending by (earlier-added geom, later-added geom), by when each was last added.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <chrono>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

// Geoms in one place, numbered as created, in no space yet.
std::vector<dGeomID> looseSpheres(std::size_t n) {
  std::vector<dGeomID> geoms;
  for (std::size_t i = 0; i < n; ++i) {
    geoms.push_back(dCreateSphere(nullptr, 1));
    setNumber(geoms.back(), i);
  }
  return geoms;
}

// Notes pairs, and takes its time for each in every other stretch of them.
struct Slow {
  std::vector<std::pair<dGeomID, dGeomID>> pairs;
  std::size_t stretch;
};
void noteSlowly(void* data, dGeomID o1, dGeomID o2) {
  using Clock = std::chrono::steady_clock;
  Slow& slow = *static_cast<Slow*>(data);
  slow.pairs.emplace_back(o1, o2);
  const Clock::time_point end = Clock::now() + std::chrono::nanoseconds(100);
  while (slow.pairs.size() / slow.stretch % 2 == 1 && Clock::now() < end) continue;
}

}  // namespace

TEST_CASE("Pairs come in their order, each once, whatever time the callback takes", "[order]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    const dWorldID world = dWorldCreate();
    const std::vector<dGeomID> geoms = looseSpheres(geomsOf(160));
    for (const dGeomID geom : geoms) {
      dSpaceAdd(space, geom);
      if (dSpaceGetNumGeoms(space) % 2) dGeomSetBody(geom, dBodyCreate(world));
    }
    for (const std::size_t stretch : {1u, 100u, 3000u, 10000u}) {
      Slow slow{{}, stretch};
      dSpaceCollide(space, &slow, noteSlowly);
      std::size_t place = 0, right = 0;
      for (std::size_t i = 0; i < geoms.size(); ++i)
        for (std::size_t j = i + 1; j < geoms.size(); ++j, ++place)
          right +=
              place < slow.pairs.size() && slow.pairs[place] == std::make_pair(geoms[i], geoms[j]);
      INFO(configuration.name << ", stretches of " << stretch);
      CHECK(slow.pairs.size() == place);
      CHECK(right == place);
    }
    dWorldDestroy(world);
  }
}

TEST_CASE("The order is that of adding, not of creation", "[order]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    const std::vector<dGeomID> geoms = looseSpheres(4);
    for (const int i : {2, 0, 3, 1}) dSpaceAdd(space, geoms[i]);
    INFO(configuration.name);
    CHECK(difference(collide(space), {{2, 0}, {2, 3}, {2, 1}, {0, 3}, {0, 1}, {3, 1}}) == "");
  }
}

TEST_CASE("dSpaceCollide2 with a geom visits the space's geoms in the order of adding", "[order]") {
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    const std::vector<dGeomID> geoms = looseSpheres(5);
    for (const int i : {3, 0, 4, 1}) dSpaceAdd(space, geoms[i]);
    dGeomSetPosition(geoms[4], dReal(0.1), 0, 0);
    INFO(configuration.name);
    CHECK(difference(collide2(space, geoms[2]), {{3, 2}, {0, 2}, {4, 2}, {1, 2}}) == "");
    CHECK(difference(collide2(geoms[2], space.geom()), {{2, 3}, {2, 0}, {2, 4}, {2, 1}}) == "");
    REQUIRE(collide(space).size() == 6);
    dGeomSetPosition(geoms[0], dReal(0.1), 0, 0);
    CHECK(difference(collide2(space, geoms[2]), {{3, 2}, {0, 2}, {4, 2}, {1, 2}}) == "");
    dGeomDestroy(geoms[2]);
  }
}
