// dParallelSAPSpaceCollidePairs hands out the pairs of dSpaceCollide, in blocks: what random calls
// (fuzz) do not reach.
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "support/tests.h"

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
  std::size_t calls = 0;
  std::function<void(std::size_t)> at_each = [](std::size_t) {};

  void operator()(const dParallelSAPPair* pairs, std::size_t count, std::size_t first) {
    {
      const std::lock_guard<std::mutex> guard(lock);
      for (std::size_t i = 0; i < count; ++i) record(&at[first], pairs[i].o1, pairs[i].o2);
      ++calls;
    }
    at_each(first);
  }
  void collide(dSpaceID space, int flags) {
    at.clear();
    calls = 0;
    dParallelSAPSpaceCollidePairs(space, this, flags, invoke<Blocks>);
  }
  Pairs joined() const {
    Pairs pairs;
    for (const auto& [first, block] : at) pairs.insert(pairs.end(), block.begin(), block.end());
    return pairs;
  }
};

bool isUsable(dSpaceID space, const Pairs& expected) {
  dGeomDestroy(dCreateSphere(space, 1));  // an assertion in a locked space
  return difference(collide(space), expected) == "";
}

}  // namespace

TEST_CASE("Blocks that the pairs fill exactly are followed by none", "[blocks]") {
  std::size_t size = 0;  // of a block
  for (const Configuration& configuration : configurations())
    for (const std::size_t row :
         {64, 300})  // boxes, of which each bar along x meets the first ones
      for (const std::size_t blocks : {2, 1, 3})
        for (const int more : {0, -1, 1}) {
          const std::size_t pairs = size ? blocks * size + static_cast<std::size_t>(more) : 2000;
          const Space space(configuration);
          World world(space);
          const auto add = [&](double low, double high, unsigned long bits) {
            const dGeomID box = world.addBox({{low, 0, 0}, {high, 1, 1}});
            dGeomSetCategoryBits(box, bits);
            dGeomSetCollideBits(box, 1);
          };
          for (double x = 0; x < static_cast<double>(row); ++x) add(x, x + 0.5, 1);
          for (std::size_t left = pairs, met; left > 0; left -= met) {
            met = std::min(left, row);
            add(0, static_cast<double>(met) - 0.25, 2);
          }
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
                if (!size) size = of_frame.at.at(0).size();
                REQUIRE(of_frame.calls == (pairs + size - 1) / size);
              }
        }
}

TEST_CASE("A callback that throws ends the call, on the calling thread", "[blocks]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {100, 3000}) {
      const Space space(configuration);
      World world(space, denseCube(geomsOf(n), seedOr(74)));
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

TEST_CASE("Concurrent callbacks collide spaces that nobody else uses, and ask their own",
          "[blocks]") {
  const Space space;
  World world(space, denseCube(3000, seedOr(77)));
  dParallelSAPSpaceSetNumThreads(space, 4);
  const auto hits = [&] {
    const dGeomID probe = dCreateBox(nullptr, 3, 3, 3);
    setNumber(probe, 1000000);
    dGeomSetPosition(probe, 4, 4, 4);
    const Pairs pairs = collide2(space, probe);
    dGeomDestroy(probe);
    return pairs;
  };
  const Pairs expected = collide(space), owed = hits();
  CHECK(owed.size() > 20);
  std::mutex lock;
  std::map<std::thread::id, dSpaceID> own;
  std::atomic<int> wrong{0}, asked{0};
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
    for (int i = 0; i < 50; ++i) wrong += hits() != owed;
    ++asked;
  };
  for (int frame = 0; frame < 10; ++frame) {
    blocks.collide(space, dParallelSAPPairsConcurrent);
    CHECK(difference(blocks.joined(), expected) == "");
  }
  CHECK(wrong == 0);
  CHECK(asked > 50);
  for (const auto& [thread, mine] : own) dSpaceDestroy(mine);
}
