// With a grain of 1 a few hundred geoms occupy every thread at every stage, and what comes of it is
// what one thread finds. Sees the library's own counts of who had work: built from its objects.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "space/preload/stand_ins.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/contact_scene.h"
#include "support/events_oracle.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/overlap_oracle.h"
#include "support/random.h"
#include "support/ray_oracle.h"
#include "support/scenes.h"
#include "support/teams.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

using Edit = void (*)(World& world, std::uint64_t seed);

void moveAll(World& world, std::uint64_t seed) {
  world.jitter(0.4, seed);
}

void moveSome(World& world, std::uint64_t seed) {
  Random random(seed);
  for (int i = 0; i < 30; ++i) {
    const dGeomID geom = world.geoms()[random.below(world.geoms().size())];
    const dReal* const at = dGeomGetPosition(geom);
    dGeomSetPosition(geom, at[0] + random.between(-1, 1), at[1], at[2]);
  }
}

void trembleAll(World& world, std::uint64_t seed) {
  world.jitter(0.001, seed);
}

// Keys of one curve for all do not tell those of a crowd apart, nor do those of a second one all of
// them.
void populateWithCrowds(World& world, std::uint64_t seed) {
  Random random(seed);
  for (const double side : {1e3, 1e-3, 1e-9})
    for (int i = 0; i < 300; ++i) {
      Box box;
      for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = random.between(0, side);
        box.high[axis] = box.low[axis] + 1;
      }
      world.addBox(box);
    }
}

void populateWithHighBits(World& world, std::uint64_t seed) {
  world.addBoxes(denseCube(700, seed));
  Random random(seed);
  constexpr int high = 8 * sizeof(long) - 4;
  for (const dGeomID geom : world.geoms()) {
    dGeomSetCategoryBits(geom, 1ul << (high + random.below(3)));
    dGeomSetCollideBits(geom, random.below(8) << high);
  }
}

void populateWithBodies(World& world, std::uint64_t seed) {
  world.addBoxes(denseCube(700, seed));
  for (const dGeomID geom : world.geoms()) world.giveBody(geom);
  dParallelSAPSpaceSetSkipStatic(world.space(), 1);
}

// All boxes reach into the planes, so that none is culled.
void populateDensely(World& world, std::uint64_t seed) {
  world.addBoxes(denseCube(700, seed));
}

// Frames of a scene, before each of which it changes, held against the oracle.
std::function<void(int threads)> framesOf(int method, Edit populate, Edit change) {
  return [=](int threads) {
    const std::uint64_t seed = seedOr(91);
    const Space space({dParallelSAPBackendCPU, method, ""});
    dParallelSAPSpaceSetNumThreads(space, threads);
    World world(space);
    populate(world, seed);
    for (std::uint64_t frame = 0; frame < 8; ++frame) {
      if (frame > 0) change(world, seed + frame);
      const Pairs pairs = collide(space);
      INFO("frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(pairs.size() > 0);
      REQUIRE(difference(pairs, expectedPairs(world.geoms())) == "");
    }
  };
}

void findContactsAndCastRays(int threads) {
  const std::uint64_t seed = seedOr(92);
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, threads);
  dParallelSAPSpaceSetEvents(space, dParallelSAPEventTouches);
  std::set<std::pair<dGeomID, dGeomID>> touches;
  ContactScene scene(space);
  // Light, heavy, on images of ODE.
  scene.fill({Kind::Box, Kind::Cylinder, Kind::Sphere, Kind::Torus}, 400, seed);
  for (std::uint64_t i = 0; i < 4; ++i) scene.add(Kind::Heightfield, 6, seed + i);
  std::vector<dGeomID> geoms;
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) geoms.push_back(dSpaceGetGeom(space, i));
  Random random(seed);
  for (std::uint64_t frame = 0; frame < 4; ++frame) {
    scene.move(seed + frame);
    const Contacts got = parallelContacts(space, 8);
    INFO("frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    REQUIRE(got.size() > 100);
    for (const Event& event : begunTouchesOf(space)) touches.emplace(event.o1, event.o2);
    for (const Event& event : endedTouchesOf(space)) touches.erase({event.o1, event.o2});
    std::set<std::pair<dGeomID, dGeomID>> touching;
    for (const Contact& contact : got) touching.emplace(contact.o1, contact.o2);
    REQUIRE(touches == touching);
    REQUIRE(difference(got, serialContacts(space, {8})) == "");
    REQUIRE(wrongRays(space, geoms, raysAt(geoms, 40, random), 4) == "");
  }
}

void findOverlaps(int threads) {
  const std::uint64_t seed = seedOr(96);
  const Space space, other;
  dParallelSAPSpaceSetNumThreads(space, threads);
  ContactScene scene(space), probing(other);
  scene.fill({Kind::Box, Kind::Sphere, Kind::Capsule}, 300, seed);
  probing.fill({Kind::Box, Kind::Cylinder}, 80, seed + 1);
  Probes probes;
  for (int i = 0; i < 80; ++i) probes.push_back({dSpaceGetGeom(other, i), nullptr, 0});
  const OverlapAnswers owed = owedOverlaps(space, probes, 4);
  REQUIRE(wrongOverlaps(space, probes, 4, owed) == "");
}

// In the callback all threads may read the numbers of pairs.
void handOutPairs(int threads) {
  const std::uint64_t seed = seedOr(93);
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, threads);
  dParallelSAPSpaceSetEvents(space, 1);
  World world(space);
  populateDensely(world, seed);
  for (std::uint64_t frame = 0; frame < 4; ++frame) {
    if (frame > 0) moveAll(world, seed + frame);
    struct Told {
      dSpaceID space;
      std::atomic<std::size_t> pairs{0}, without_numbers{0};
    } told = {space, {0}, {0}};
    dParallelSAPSpaceCollidePairs(
        space, &told, dParallelSAPPairsConcurrent,
        [](void* data, const dParallelSAPPair*, std::size_t count, std::size_t first) {
          Told& told = *static_cast<Told*>(data);
          told.pairs += count;
          const unsigned* numbers;
          const std::size_t numbered = dParallelSAPSpaceGetPairNumbers(told.space, &numbers);
          if (numbered < first + count || !numbers) ++told.without_numbers;
        });
    INFO("frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    const std::size_t pairs = told.pairs;
    REQUIRE(pairs == expectedPairs(world.geoms()).size());
    REQUIRE(told.without_numbers == 0);
    const unsigned* numbers;
    REQUIRE(dParallelSAPSpaceGetPairNumbers(space, &numbers) == pairs);
  }
}

void findContactsBeforeDCollide(int threads) {
  const Variable on("ODE_PARALLEL_SAP_CONTACTS", "on");
  const dParallelSAPStandIns& stand_ins = *dParallelSAPGetStandIns();
  struct Call {
    const dParallelSAPStandIns& stand_ins;
    int found = 0;
    static void collide(void* data, dGeomID o1, dGeomID o2) {
      Call& own = *static_cast<Call*>(data);
      dContactGeom found[8], expected[8];
      const int count = own.stand_ins.collide(o1, o2, 8, found, sizeof found[0]);
      if (count < 0) return;
      ++own.found;
      REQUIRE(count == dCollide(o1, o2, 8, expected, sizeof expected[0]));
      for (int i = 0; i < count; ++i) REQUIRE(found[i].depth == expected[i].depth);
    }
  };
  const dSpaceID space = stand_ins.create(nullptr, dHashSpaceClass);
  dParallelSAPSpaceSetNumThreads(space, threads);
  {
    ContactScene scene(space);
    scene.fill({Kind::Box, Kind::Sphere, Kind::Capsule}, 400, seedOr(95));
    Call call = {stand_ins};
    for (int frame = 0; frame < 4; ++frame) dSpaceCollide(space, &call, Call::collide);
    CHECK(call.found > 100);
  }
  dSpaceDestroy(space);
}

// Work, and the regions in which teams share it.
struct Work {
  const char* name;
  std::function<void(int threads)> run;
  std::vector<std::string> regions;
};

const Work kWorks[] = {
    {"all boxes move",
     framesOf(dParallelSAPMethodSweep, populateDensely, moveAll),
     {"update: geoms", "cell order: regions", "cell order: centres", "cell order: halves",
      "cell trees: cells", "sweep: active boxes", "sweep: tasks", "rows: pairs"}},
    {"crowds in one place",
     framesOf(dParallelSAPMethodSweep, populateWithCrowds, moveSome),
     {"changed pairs: boxes", "rows: pairs"}},
    {"brute force",
     framesOf(dParallelSAPMethodBruteForce, populateDensely, moveAll),
     {"brute force: pairs"}},
    {"axis lists",
     framesOf(dParallelSAPMethodAxisLists, populateDensely, moveAll),
     {"axis lists: axes", "axis lists: places", "axis lists: pairs of all axes"}},
    {"some boxes move",
     framesOf(dParallelSAPMethodSweep, populateDensely, moveSome),
     {"update: what changed unnoticed", "geom tree: boxes", "geom tree: moved boxes",
      "cell trees: places", "changed pairs: boxes", "pair merge: parts"}},
    {"all boxes tremble",
     framesOf(dParallelSAPMethodSweep, populateDensely, trembleAll),
     {"fat proxies: boxes", "fat proxies: fat boxes", "fat proxies: candidates"}},
    {"bits that boxes have no room for",
     framesOf(dParallelSAPMethodBruteForce, populateWithHighBits, moveAll),
     {"pair list: exact tests"}},
    {"geoms at rest are left out",
     framesOf(dParallelSAPMethodSweep, populateWithBodies, moveAll),
     {"filter: verified pairs"}},
    {"contacts and rays",
     findContactsAndCastRays,
     {"contacts: list of pairs", "contacts: pairs", "contacts: heavy pairs",
      "contacts: pairs on images", "touch events: pairs", "rays: rays", "rays: geoms on images"}},
    {"probes", findOverlaps, {"overlaps: probes"}},
    {"pairs in blocks", handOutPairs, {"pairs in blocks: blocks", "pair events: comparison"}},
    {"contacts before dCollide is called", findContactsBeforeDCollide, {"contacts: pairs"}}};

}  // namespace

TEST_CASE("With a grain of 1 two threads and more have work in every region, and find the same") {
  const ScopedGrain grain(1);
  for (const Work& work : kWorks)
    for (const int threads : {2, 3, 7, 16}) {
      const auto before = timesShared();
      INFO(work.name << ", " << threads << " threads");
      work.run(threads);
      const auto after = timesShared();
      for (const std::string& region : work.regions) {
        INFO(region);
        REQUIRE(after.count(region) == 1);
        CHECK(after.at(region) > before.at(region));
      }
    }
}

TEST_CASE("Small batches of rays and probes are one thread's work") {
  const Space space;
  World world(space);
  populateDensely(world, 1);
  dParallelSAPSpaceSetNumThreads(space, 3);
  Probes probes;
  for (int i = 0; i < 40; ++i) probes.push_back({world.geoms()[i], nullptr, 0});
  const Rays rays(40, rayOf({-1, 4, 4}, {1, 0, 0}, 20));
  const auto before = timesShared();
  dParallelSAPSpaceOverlaps(space, probes.data(), 40, sizeof probes[0], 1, nullptr, nullptr);
  REQUIRE(nearestHits(space, rays, 0).size() == 40);
  CHECK(timesShared() == before);
}

// Those of a device are looked at by device_test.
TEST_CASE("There is no region that this test leaves out") {
  std::set<std::string> covered;
  for (const Work& work : kWorks) covered.insert(work.regions.begin(), work.regions.end());
  for (const auto& [region, times] : timesShared()) {
    INFO(region);
    CHECK((covered.count(region) == 1 || isOfDevice(region)));
  }
}
