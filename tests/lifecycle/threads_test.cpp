// The number of threads changes the time, never the sequence.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
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
    const std::size_t n = std::min(scene.most, geomsOf(4000));
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
      world.addBoxes(clusters(geomsOf(5000), seed));
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

namespace {

// A space with a scene of its own that moves from frame to frame.
class Player {
 public:
  Player(const Configuration& configuration, int threads, std::uint64_t seed)
      : space_(configuration), world_(space_), seed_(seed) {
    dParallelSAPSpaceSetNumThreads(space_, threads);
    world_.addBoxes(denseCube(geomsOf(2500) + 10 * (seed % 3), seed));
  }

  // The pairs of each frame.
  std::vector<Pairs> play() {
    std::vector<Pairs> record;
    for (int frame = 0; frame < scaled(12); ++frame) {
      world_.jitter(0.3, 100 * seed_ + static_cast<std::uint64_t>(frame));
      record.push_back(collide(space_));
    }
    return record;
  }

 private:
  const Space space_;
  World world_;
  const std::uint64_t seed_;
};

// What every player reports when each plays in a thread of its own.
std::vector<std::vector<Pairs>> playAtOnce(std::deque<Player>& players) {
  std::vector<std::vector<Pairs>> records(players.size());
  // Catch's assertions stay on this thread.
  std::vector<std::string> problems(players.size());
  std::vector<std::thread> workers;
  for (std::size_t i = 0; i < players.size(); ++i) {
    workers.emplace_back([&, i] {
      try {
        if (!dAllocateODEDataForThread(dAllocateMaskAll)) throw std::runtime_error("no ODE data");
        records[i] = players[i].play();
      } catch (const std::exception& error) {
        problems[i] = error.what();
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  for (const std::string& problem : problems) REQUIRE(problem == "");
  return records;
}

}  // namespace

TEST_CASE("Spaces collide from different threads at once", "[threads]") {
  const std::uint64_t seed = seedOr(43);
  for (const Configuration& configuration : configurations()) {
    for (const int threads_each : {1, 3}) {
      std::vector<std::vector<Pairs>> alone;
      std::deque<Player> players;
      for (std::uint64_t i = 0; i < 3; ++i) {
        alone.push_back(Player(configuration, threads_each, seed + i).play());
        players.emplace_back(configuration, threads_each, seed + i);
      }
      const std::vector<std::vector<Pairs>> at_once = playAtOnce(players);
      for (std::size_t i = 0; i < alone.size(); ++i) {
        REQUIRE(at_once[i].size() == alone[i].size());
        for (std::size_t frame = 0; frame < alone[i].size(); ++frame) {
          INFO(configuration.name << ", " << threads_each << " threads each, space " << i
                                  << ", frame " << frame);
          REQUIRE(!alone[i][frame].empty());
          REQUIRE(difference(at_once[i][frame], alone[i][frame]) == "");
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
      } catch (const std::exception& error) {
        problem = error.what();
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  for (const std::string& problem : problems) CHECK(problem == "");
}

// With a grain of the tests teams are as large as they can be, whatever they wait for.
TEST_CASE("A team that waits for a thread is left out of the next frames",
          "[threads][usual-grain]") {
  const Space space;
  World world(space);
  world.addBoxes(denseCube(1000, seedOr(44)));
  // A thread that is not running takes its time, and the calling thread so much of it that others
  // have work at all.
  static std::atomic<bool> slept;
  static bool begun;
  static std::thread::id here;
  here = std::this_thread::get_id();
  const auto flags = [](void*, dGeomID, dGeomID) {
    using std::chrono::milliseconds;
    if (std::this_thread::get_id() == here) {
      if (!std::exchange(begun, true)) std::this_thread::sleep_for(milliseconds(5));
    } else if (!slept.exchange(true)) {
      std::this_thread::sleep_for(milliseconds(50));
    }
    return 1;
  };
  const auto ignore = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
  const dParallelSAPContactCallbacks callbacks = {ignore, flags, nullptr, nullptr};
  int stalls = 0;
  for (int frame = 0; frame < 40; ++frame) {
    slept = begun = false;
    dParallelSAPSpaceCollideContacts(space, nullptr, 0, &callbacks);
    stalls += slept;
  }
  // Each one ends the use of teams, at first for 16 frames.
  CHECK(stalls <= 3);
}
