// With a grain of 1 a few hundred geoms occupy every thread at every stage, and what comes of it is
// what one thread finds. Sees the library's own counts of who had work: built from its objects.
#include <atomic>

#include "fuzz/driver.h"
#include "space/preload/stand_ins.h"
#include "support/contact_scene.h"
#include "support/overlap_oracle.h"
#include "support/ray_oracle.h"
#include "support/teams.h"
#include "support/tests.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

// Spaces of the driver take as many threads as the environment says.
void playRandomCalls(std::uint64_t world) {
  Decisions decisions(world);
  Driver driver(decisions, 400);
  for (int i = 0; i < 60 && driver.problem().empty(); ++i) driver.step();
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << world);
  REQUIRE(driver.problem() == "");
}

// In the callback all threads may read the numbers of pairs.
void handOutPairs(int threads) {
  const std::uint64_t seed = seedOr(93);
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, threads);
  dParallelSAPSpaceSetEvents(space, 1);
  World world(space, denseCube(700, seed));
  for (std::uint64_t frame = 0; frame < 4; ++frame) {
    if (frame > 0) world.jitter(0.4, seed + frame);
    std::atomic<std::size_t> pairs{0}, without_numbers{0};
    auto take = [&](const dParallelSAPPair*, std::size_t count, std::size_t first) {
      pairs += count;
      const unsigned* numbers;
      if (dParallelSAPSpaceGetPairNumbers(space, &numbers) < first + count || !numbers)
        ++without_numbers;
    };
    dParallelSAPSpaceCollidePairs(space, &take, dParallelSAPPairsConcurrent,
                                  invoke<decltype(take)>);
    INFO("frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    REQUIRE(pairs == expectedPairs(world.geoms()).size());
    REQUIRE(without_numbers == 0);
  }
}

// Light, heavy, on images of ODE.
void findContacts(int threads) {
  const std::uint64_t seed = seedOr(92);
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, threads);
  ContactScene scene(space);
  scene.fill({Kind::Box, Kind::Cylinder, Kind::Sphere, Kind::Torus}, 400, seed);
  for (std::uint64_t i = 0; i < 4; ++i) scene.add(Kind::Heightfield, 6, seed + i);
  for (std::uint64_t frame = 0; frame < 4; ++frame) {
    scene.move(seed + frame);
    const Contacts got = parallelContacts(space, 8);
    INFO("frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    REQUIRE(got.size() > 100);
    REQUIRE(difference(got, serialContacts(space, {8})) == "");
  }
}

void findContactsBeforeDCollide(int threads) {
  const Variable on("ODE_PARALLEL_SAP_CONTACTS", "on");
  const dParallelSAPStandIns& stand_ins = *dParallelSAPGetStandIns();
  const dSpaceID space = stand_ins.create(nullptr, dHashSpaceClass);
  dParallelSAPSpaceSetNumThreads(space, threads);
  {
    ContactScene scene(space);
    scene.fill({Kind::Box, Kind::Sphere, Kind::Capsule}, 400, seedOr(95));
    int pairs = 0;
    for (int frame = 0; frame < 4; ++frame)
      collide(space, [&](dGeomID o1, dGeomID o2) {
        dContactGeom found[8], expected[8];
        const int count = stand_ins.collide(o1, o2, 8, found, sizeof found[0]);
        if (count < 0) return;
        ++pairs;
        REQUIRE(count == dCollide(o1, o2, 8, expected, sizeof expected[0]));
        for (int i = 0; i < count; ++i) REQUIRE(found[i].depth == expected[i].depth);
      });
    CHECK(pairs > 100);
  }
  dSpaceDestroy(space);
}

}  // namespace

// Regions of a device are looked at by device_test.
TEST_CASE("With a grain of 1 two threads and more have work in every region, and find the same") {
  const ScopedGrain grain(1);
  for (const int threads : {2, 3, 7, 16}) {
    const Variable number("ODE_PARALLEL_SAP_THREADS", std::to_string(threads).c_str());
    const auto before = timesShared();
    const auto idleRegions = [&] {
      std::string idle;
      for (const auto& [region, times] : timesShared())
        if (!isOfDevice(region) && times == before.at(region)) idle += region + "; ";
      return idle;
    };
    for (const auto work : {handOutPairs, findContacts, findContactsBeforeDCollide}) work(threads);
    // Compilers draw the worlds' numbers in orders of their own, so that other worlds need them.
    for (std::uint64_t world = 0; world < 10 || (world < 100 && idleRegions() != ""); ++world)
      playRandomCalls(seedOr(1, world));
    INFO(threads << " threads");
    CHECK(idleRegions() == "");
  }
}

TEST_CASE("Small batches of rays and probes are one thread's work") {
  const Space space;
  World world(space, denseCube(700, 1));
  dParallelSAPSpaceSetNumThreads(space, 3);
  Probes probes;
  for (int i = 0; i < 40; ++i) probes.push_back({world.geoms()[i], nullptr, 0});
  const Rays rays(40, rayOf({-1, 4, 4}, {1, 0, 0}, 20));
  const auto before = timesShared();
  dParallelSAPSpaceOverlaps(space, probes.data(), 40, sizeof probes[0], 1, nullptr, nullptr);
  REQUIRE(nearestHits(space, rays, 0).size() == 40);
  CHECK(timesShared() == before);
}
