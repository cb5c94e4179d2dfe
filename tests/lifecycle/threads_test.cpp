// The number of threads changes the time, never the sequence.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/scenes.h"

using namespace sap_test;

TEST_CASE("Every number of threads gives the expected sequence in every scene", "[threads]") {
  const std::uint64_t seed = seedOr(41);
  for (const WorldScene& scene : worldScenes()) {
    const std::size_t n = std::min(scene.most, geomsOf(4000));
    const Space space;
    World world(space);
    scene.populate(world, n, seed);
    Pairs expected;
    for (const Configuration& configuration : configurations()) {
      configure(space, configuration);
      for (const int threads : {1, 2, 3, 7, 16}) {
        dParallelSAPSpaceSetNumThreads(space, threads);
        const Pairs got = collide(space);
        if (expected.empty()) expected = expectedPairs(world.geoms());
        INFO(configuration.name << ", " << threads << " threads, " << scene.name
                                << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        REQUIRE(difference(got, expected) == "");
        REQUIRE(statsOf(space).threads >= 1);
        REQUIRE(statsOf(space).threads <= threads);
      }
    }
  }
}

namespace {

// The pairs of each frame of a scene that moves, in a space of its own.
std::vector<Pairs> play(const Configuration& configuration, int threads, std::uint64_t seed) {
  const Space space(configuration);
  dParallelSAPSpaceSetNumThreads(space, threads);
  World world(space);
  world.addBoxes(denseCube(geomsOf(2500) + 10 * (seed % 3), seed));
  std::vector<Pairs> frames;
  for (int frame = 0; frame < scaled(12); ++frame) {
    world.jitter(0.3, 100 * seed + static_cast<std::uint64_t>(frame));
    frames.push_back(collide(space));
  }
  return frames;
}

}  // namespace

TEST_CASE("Spaces are created, used and destroyed by different threads at once", "[threads]") {
  const std::uint64_t seed = seedOr(43);
  for (const Configuration& configuration : configurations())
    for (const int threads_each : {1, 3}) {
      std::vector<std::vector<Pairs>> alone, at_once(3);
      for (std::uint64_t i = 0; i < 3; ++i)
        alone.push_back(play(configuration, threads_each, seed + i));
      std::vector<std::thread> workers;
      for (std::size_t i = 0; i < 3; ++i)
        workers.emplace_back([&, i] {
          if (dAllocateODEDataForThread(dAllocateMaskAll))
            at_once[i] = play(configuration, threads_each, seed + i);
        });
      for (std::thread& worker : workers) worker.join();
      for (std::size_t i = 0; i < 3; ++i) {
        INFO(configuration.name << ", " << threads_each << " threads each, space " << i);
        for (const Pairs& frame : alone[i]) REQUIRE(!frame.empty());
        REQUIRE((at_once[i] == alone[i]));
      }
    }
}
