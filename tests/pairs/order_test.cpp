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
