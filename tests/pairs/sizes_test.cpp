// No number of geoms is special: around the widths of vectors, chunks and small-scene shortcuts.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <string>
#include <utility>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

void checkScene(const Configuration& configuration, const WorldScene& scene, std::size_t n) {
  const std::uint64_t seed = seedOr(30 + n);
  const Space space(configuration);
  World world(space);
  scene.populate(world, n, seed);
  INFO(configuration.name << ", " << scene.name << ", " << n << " geoms, "
                          << "ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
}

const std::size_t kSizes[] = {0,   1,   2,   3,   4,   5,    7,    8,    9,    15,  16,  17,
                              31,  32,  33,  63,  64,  65,   100,  127,  128,  129, 255, 256,
                              257, 300, 511, 512, 513, 1023, 1024, 1025, 1234, 5000};

}  // namespace

TEST_CASE("Every size of every scene gives exactly the expected pairs", "[sizes]") {
  for (const Configuration& configuration : configurations()) {
    for (const WorldScene& scene : worldScenes()) {
      for (const std::size_t n : kSizes) {
        if (n <= scene.most) checkScene(configuration, scene, n);
      }
    }
  }
}

TEST_CASE("Twenty thousand geoms give the same pairs whatever the method", "[sizes]") {
  // Too many for the oracle: against each other, one of them being brute force.
  const std::uint64_t seed = seedOr(31);
  const std::size_t n = static_cast<std::size_t>(scaled(20000));
  for (const Boxes& boxes : {sixDecades(n, seed), farClusters(n, seed), longBars(n, seed)}) {
    Pairs first;
    std::string name_of_first;
    for (const Configuration& configuration : configurations()) {
      if (configuration.method == dParallelSAPMethodAxisLists) continue;  // memory
      const Space space(configuration);
      World world(space);
      world.addBoxes(boxes);
      Pairs pairs = collide(space);
      INFO(configuration.name << " against " << name_of_first);
      if (name_of_first.empty()) {
        first = std::move(pairs);
        name_of_first = configuration.name;
        REQUIRE(std::is_sorted(first.begin(), first.end()));
        REQUIRE(std::adjacent_find(first.begin(), first.end()) == first.end());
        REQUIRE(!first.empty());
      } else {
        REQUIRE(difference(pairs, first) == "");
      }
    }
  }
}
