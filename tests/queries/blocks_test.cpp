// dParallelSAPSpaceCollidePairs hands out the pairs of dSpaceCollide, in blocks.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/contact_scene.h"
#include "support/floating_point.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

const int kThreads[] = {1, 2, 3, 7, 16};
const int kFlags[] = {0, dParallelSAPPairsConcurrent};

struct Stop : std::runtime_error {
  Stop() : std::runtime_error("stop") {}
};

// The blocks of a call by the places of their first pairs, and what is done at each of them.
struct Blocks {
  std::mutex lock;
  std::map<std::size_t, Pairs> at;
  std::vector<std::size_t> order;  // in which they came
  std::set<std::thread::id> threads;
  std::function<void(std::size_t)> at_each = [](std::size_t) {};

  static void take(void* data, const dParallelSAPPair* pairs, std::size_t count,
                   std::size_t first) {
    Blocks& self = *static_cast<Blocks*>(data);
    {
      const std::lock_guard<std::mutex> guard(self.lock);
      Pairs& block = self.at[first];
      for (std::size_t i = 0; i < count; ++i) record(&block, pairs[i].o1, pairs[i].o2);
      self.order.push_back(first);
      self.threads.insert(std::this_thread::get_id());
    }
    self.at_each(first);
  }
  void collide(dSpaceID space, int flags) {
    at.clear();
    order.clear();
    threads.clear();
    dParallelSAPSpaceCollidePairs(space, this, flags, take);
  }
  Pairs joined() const {
    Pairs pairs;
    for (const auto& [first, block] : at) pairs.insert(pairs.end(), block.begin(), block.end());
    return pairs;
  }
  // All follow each other, and all but the last have one size.
  bool areWhole() const {
    if (order.size() != at.size()) return false;  // two began at one place
    std::size_t next = 0;
    for (const auto& [first, block] : at) {
      const bool last = first == at.rbegin()->first;
      if (first != next || block.empty() || (!last && block.size() != at.begin()->second.size()) ||
          block.size() > at.begin()->second.size())
        return false;
      next += block.size();
    }
    return true;
  }
};

bool isUsable(dSpaceID space, const Pairs& expected) {
  dGeomDestroy(dCreateSphere(space, 1));  // an assertion in a locked space
  return difference(collide(space), expected) == "";
}

}  // namespace

TEST_CASE("Blocks one after the other are the pairs of dSpaceCollide, for any threads",
          "[blocks]") {
  const std::uint64_t seed = seedOr(71);
  for (const Configuration& configuration : configurations())
    for (const WorldScene& scene : worldScenes())
      for (const std::size_t n : {8, 100, 200, 3000}) {
        if (n > scene.most) continue;
        const Space space(configuration);
        World world(space);
        scene.populate(world, geomsOf(n), seed);
        const Pairs expected = collide(space);
        std::vector<std::size_t> places;
        for (const int threads : kThreads)
          for (const int flags : kFlags) {
            dParallelSAPSpaceSetNumThreads(space, threads);
            world.jitter(0, seed);  // all is found anew
            Blocks blocks;
            blocks.collide(space, flags);
            INFO(configuration.name << ", " << scene.name << ", " << n << " geoms, " << threads
                                    << " threads, flags " << flags
                                    << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
            REQUIRE(difference(blocks.joined(), expected) == "");
            REQUIRE(blocks.areWhole());
            if (flags == 0) {
              REQUIRE(std::is_sorted(blocks.order.begin(), blocks.order.end()));
              REQUIRE(blocks.threads.size() <= 1);
            }
            if (places.empty()) places = blocks.order;
            std::sort(blocks.order.begin(), blocks.order.end());
            REQUIRE(blocks.order == places);
          }
      }
}

TEST_CASE("Blocks that the pairs fill exactly are followed by none", "[blocks]") {
  // So many pairs: each of some bars along x meets the first ones of a row of boxes, and no bar.
  const auto populate = [](World& world, std::size_t row, std::size_t pairs) {
    for (std::size_t i = 0; i < row; ++i) {
      const double x = static_cast<double>(i);
      world.addBox({{x, 0, 0}, {x + 0.5, 1, 1}});
      dGeomSetCategoryBits(world.geoms().back(), 1);
      dGeomSetCollideBits(world.geoms().back(), 1);
    }
    for (std::size_t left = pairs; left > 0;) {
      const std::size_t met = std::min(left, row);
      world.addBox({{0, 0, 0}, {static_cast<double>(met) - 0.25, 1, 1}});
      dGeomSetCategoryBits(world.geoms().back(), 2);
      dGeomSetCollideBits(world.geoms().back(), 1);
      left -= met;
    }
  };
  std::size_t size = 0;  // of a block
  for (const Configuration& configuration : configurations())
    for (const std::size_t row : {64, 300})
      for (const std::size_t blocks : {2, 1, 3})
        for (const int more : {0, -1, 1}) {
          const std::size_t pairs = size ? blocks * size + static_cast<std::size_t>(more) : 2000;
          const Space space(configuration);
          World world(space);
          populate(world, row, pairs);
          for (const int threads : {1, 3})
            for (const int flags : kFlags)
              for (const double moved : {0.0, 0.0, 1e-9}) {
                dParallelSAPSpaceSetNumThreads(space, threads);
                if (moved > 0) world.jitter(moved, 1);
                Blocks of_frame;
                of_frame.collide(space, flags);
                INFO(configuration.name << ", a row of " << row << ", " << pairs << " pairs, "
                                        << threads << " threads, flags " << flags << ", moved "
                                        << moved);
                REQUIRE(difference(of_frame.joined(), expectedPairs(world.geoms())) == "");
                REQUIRE(of_frame.joined().size() == pairs);
                REQUIRE(of_frame.areWhole());
                if (size) REQUIRE(of_frame.order.size() == (pairs + size - 1) / size);
                if (!size) size = of_frame.at.at(0).size();
                REQUIRE(statsOf(space).pairs == pairs);
              }
        }
}

TEST_CASE("Concurrent blocks are at work at the same time, in the caller's floating-point mode",
          "[blocks]") {
  const Space space;
  World world(space);
  world.addBoxes(denseCube(3000, seedOr(73)));
  dParallelSAPSpaceSetNumThreads(space, 2);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  std::atomic<int> inside{0};
  std::atomic<bool> met{false}, other_mode{false};
  Blocks blocks;
  const FloatingPointMode mode(FloatingPointMode::kUpward);
  const unsigned own = FloatingPointMode::current();
  blocks.at_each = [&](std::size_t) {
    if (++inside == 2) met = true;
    while (!met && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    if (FloatingPointMode::current() != own) other_mode = true;
    --inside;
  };
  blocks.collide(space, dParallelSAPPairsConcurrent);
  CHECK(met);
  CHECK(!other_mode);
  CHECK(blocks.threads.size() == 2);
  CHECK(statsOf(space).threads == 2);
}

TEST_CASE("A callback that throws ends the call, on the calling thread", "[blocks]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {100, 3000}) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(geomsOf(n), seedOr(74)));
      const Pairs expected = collide(space);
      for (const int threads : kThreads)
        for (const int flags : kFlags) {
          dParallelSAPSpaceSetNumThreads(space, threads);
          Blocks blocks;
          std::atomic<bool> thrown{false};
          std::atomic<int> begun_after{0};
          blocks.at_each = [&](std::size_t first) {
            if (thrown) {
              ++begun_after;
              std::this_thread::sleep_for(std::chrono::milliseconds(10));
            }
            if (first == 0) {
              thrown = true;
              throw Stop();
            }
          };
          INFO(configuration.name << ", " << n << " geoms, " << threads << " threads, flags "
                                  << flags);
          REQUIRE_THROWS_AS(blocks.collide(space, flags), Stop);
          REQUIRE(isUsable(space, expected));
          // Those that the other threads took before they could know, and far from all.
          if (threads == 1 || flags == 0) CHECK(begun_after == 0);
          if (threads <= 3) CHECK(begun_after <= 12);
        }
    }
}

TEST_CASE("Blocks tell the places of their pairs among all, also after one has left", "[blocks]") {
  for (const std::size_t n : {100, 600}) {  // small, and not
    const Space space;
    World world(space);
    world.addBoxes(onePlace(n, seedOr(75)));
    const dGeomID gone = dCreateSphere(space, dReal(0.1));
    const dReal* const place = dGeomGetPosition(world.geoms()[0]);
    dGeomSetPosition(gone, place[0], place[1], place[2]);
    const Pairs all = collide(space);
    Blocks blocks;
    blocks.at_each = [&](std::size_t first) {
      if (first == 0) dGeomDestroy(gone);
    };
    blocks.collide(space, 0);
    INFO(n << " geoms, " << all.size() << " pairs");
    REQUIRE(blocks.at.size() > 2);
    for (const auto& [first, block] : blocks.at)
      for (std::size_t i = 0; i < block.size(); ++i) REQUIRE(block[i] == all[first + i]);
  }
}

TEST_CASE("Callbacks collide within callbacks, whatever kind of collide they are of", "[blocks]") {
  for (const std::size_t n : {60, 700}) {
    const Space space, other;
    World world(space), others(other);
    world.addBoxes(denseCube(n, seedOr(76)));
    others.addBoxes(denseCube(n + 50, seedOr(76)));
    const Pairs expected = collide(space), of_other = collide(other);
    const dParallelSAPContactCallbacks contacts = {recordContacts, nullptr, nullptr, nullptr};
    for (const int flags : kFlags)
      for (int frame = 0; frame < 3; ++frame) {
        INFO(n << " geoms, flags " << flags << ", frame " << frame);
        Blocks outer, inner, inner_of_other;
        bool done = false;
        outer.at_each = [&](std::size_t) {
          if (std::exchange(done, true)) return;
          inner.collide(space, flags);
          REQUIRE(difference(collide(space), expected) == "");
          Contacts found;
          dParallelSAPSpaceCollideContacts(space, &found, 4, &contacts);
          inner_of_other.collide(other, flags);
        };
        outer.collide(space, 0);
        CHECK(difference(outer.joined(), expected) == "");
        CHECK(difference(inner.joined(), expected) == "");
        CHECK(difference(inner_of_other.joined(), of_other) == "");
        CHECK(statsOf(space).pairs == expected.size());

        struct Within {
          dSpaceID space;
          int flags;
          Blocks blocks;
          static void call(void* data, dGeomID, dGeomID) {
            Within& self = *static_cast<Within*>(data);
            if (self.blocks.at.empty()) self.blocks.collide(self.space, self.flags);
          }
        } within{space, flags, {}};
        dSpaceCollide(space, &within, Within::call);
        CHECK(difference(within.blocks.joined(), expected) == "");
      }
  }
}

TEST_CASE("Concurrent callbacks collide spaces that nobody else uses", "[blocks]") {
  const Space space;
  World world(space);
  world.addBoxes(denseCube(3000, seedOr(77)));
  dParallelSAPSpaceSetNumThreads(space, 3);
  const Pairs expected = collide(space);
  std::mutex lock;
  std::map<std::thread::id, dSpaceID> own;
  std::atomic<int> wrong{0};
  Blocks blocks;
  blocks.at_each = [&](std::size_t) {
    dSpaceID mine;
    {
      const std::lock_guard<std::mutex> guard(lock);
      dSpaceID& entry = own[std::this_thread::get_id()];
      if (!entry) {
        entry = dParallelSAPSpaceCreate(nullptr);
        for (int i = 0; i < 300; ++i) setNumber(dCreateSphere(entry, 1), i);
      }
      mine = entry;
    }
    wrong += collide(mine).size() != 300 * 299 / 2;
  };
  blocks.collide(space, dParallelSAPPairsConcurrent);
  CHECK(wrong == 0);
  CHECK(difference(blocks.joined(), expected) == "");
  for (const auto& [thread, mine] : own) dSpaceDestroy(mine);
}

TEST_CASE("An empty space has no blocks", "[blocks]") {
  const Space space;
  Blocks blocks;
  for (const int flags : kFlags) blocks.collide(space, flags);
  dCreateSphere(space, 1);
  for (const int flags : kFlags) blocks.collide(space, flags);
  CHECK(blocks.at.empty());
}
