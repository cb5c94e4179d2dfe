// The number of threads changes the time, never the sequence.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

const int kThreads[] = {1, 2, 3, 7, 16};

}  // namespace

TEST_CASE("Every number of threads gives the expected sequence in every scene", "[threads]") {
  const std::uint64_t seed = seedOr(41);
  for (const WorldScene& scene : worldScenes()) {
    const std::size_t n = std::min<std::size_t>(scene.most, 4000);
    const Space space;
    World world(space);
    scene.populate(world, n, seed);
    Pairs expected;
    for (const Configuration& configuration : configurations()) {
      configure(space, configuration);
      for (const int threads : kThreads) {
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

TEST_CASE("Every number of threads gives the same sequence of frames while all moves",
          "[threads]") {
  const std::uint64_t seed = seedOr(42);
  for (const Configuration& configuration : configurations()) {
    std::vector<Pairs> frames;
    for (const int threads : kThreads) {
      const Space space(configuration);
      dParallelSAPSpaceSetNumThreads(space, threads);
      World world(space);
      world.addBoxes(clusters(5000, seed));
      for (std::size_t frame = 0; frame < 4; ++frame) {
        world.jitter(0.4, seed + frame);
        Pairs pairs = collide(space);
        INFO(configuration.name << ", " << threads << " threads, frame " << frame);
        if (threads == kThreads[0]) {
          REQUIRE(!pairs.empty());
          frames.push_back(std::move(pairs));
        } else {
          REQUIRE(difference(pairs, frames[frame]) == "");
        }
      }
    }
  }
}

TEST_CASE("A scene of fifty thousand geoms does use the threads it may", "[threads]") {
  for (const Configuration& configuration : configurations()) {
    if (configuration.backend != dParallelSAPBackendCPU ||
        configuration.method != dParallelSAPMethodSweep) {
      continue;
    }
    const Space space(configuration);
    World world(space);
    world.addBoxes(denseCube(50000, 1));
    for (const int threads : {1, 2}) {
      dParallelSAPSpaceSetNumThreads(space, threads);
      CHECK(!collide(space).empty());
      CHECK(statsOf(space).threads == threads);
    }
  }
}

TEST_CASE("Spaces collide from different threads at once", "[threads]") {
  const std::uint64_t seed = seedOr(43);
  const int frames = scaled(12);
  for (const Configuration& configuration : configurations()) {
    for (const int threads_each : {1, 3}) {
      constexpr std::size_t kSpaces = 3;
      // Alone first, then at once. Catch's assertions stay on this thread.
      std::vector<Pairs> alone[kSpaces], at_once[kSpaces];
      const auto play = [&](dSpaceID space, World& world, std::size_t which,
                            std::vector<Pairs>& record) {
        for (int frame = 0; frame < frames; ++frame) {
          world.jitter(0.3, seed + 100 * which + static_cast<std::uint64_t>(frame));
          record.push_back(collide(space));
        }
      };
      const auto make = [&](dSpaceID space, World& world, std::size_t which) {
        dParallelSAPSpaceSetNumThreads(space, threads_each);
        world.addBoxes(denseCube(2500 + 10 * which, seed + which));
      };
      for (std::size_t i = 0; i < kSpaces; ++i) {
        const Space space(configuration);
        World world(space);
        make(space, world, i);
        play(space, world, i, alone[i]);
      }
      {
        // One member apart from the other, so that each world goes before its space.
        const Space a(configuration), b(configuration), c(configuration);
        World wa(a), wb(b), wc(c);
        const dSpaceID spaces[kSpaces] = {a, b, c};
        World* const worlds[kSpaces] = {&wa, &wb, &wc};
        std::vector<std::thread> workers;
        std::vector<std::string> problems(kSpaces);
        for (std::size_t i = 0; i < kSpaces; ++i) make(spaces[i], *worlds[i], i);
        for (std::size_t i = 0; i < kSpaces; ++i) {
          workers.emplace_back([&, i] {
            try {
              if (!dAllocateODEDataForThread(dAllocateMaskAll)) problems[i] = "no ODE data";
              play(spaces[i], *worlds[i], i, at_once[i]);
              dCleanupODEAllDataForThread();
            } catch (const std::exception& error) {
              problems[i] = error.what();
            }
          });
        }
        for (std::thread& worker : workers) worker.join();
        for (const std::string& problem : problems) REQUIRE(problem == "");
      }
      for (std::size_t i = 0; i < kSpaces; ++i) {
        for (std::size_t frame = 0; frame < alone[i].size(); ++frame) {
          INFO(configuration.name << ", " << threads_each << " threads each, space " << i
                                  << ", frame " << frame);
          REQUIRE(!alone[i][frame].empty());
          REQUIRE(difference(at_once[i].at(frame), alone[i][frame]) == "");
        }
      }
    }
  }
}

TEST_CASE("Spaces are created, used and destroyed by threads of their own", "[threads]") {
  const std::uint64_t seed = seedOr(44);
  const Boxes boxes = denseCube(600, seed);
  const Pairs expected = [&] {
    const Space space;
    World world(space);
    world.addBoxes(boxes);
    const Pairs pairs = collide(space);
    REQUIRE(difference(pairs, expectedPairs(world.geoms())) == "");
    return pairs;
  }();
  std::vector<std::string> problems(4, "did not run");
  std::vector<std::thread> workers;
  for (std::string& problem : problems) {
    workers.emplace_back([&] {
      try {
        if (!dAllocateODEDataForThread(dAllocateMaskAll)) throw std::runtime_error("no ODE data");
        problem = "";
        for (int round = 0; round < 5 && problem.empty(); ++round) {
          const Space space;
          World world(space);
          world.addBoxes(boxes);
          problem = difference(collide(space), expected);
        }
        dCleanupODEAllDataForThread();
      } catch (const std::exception& error) {
        problem = error.what();
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  for (const std::string& problem : problems) CHECK(problem == "");
}
