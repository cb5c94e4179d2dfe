// Memory: grows with the scene, stays while the scene does, and goes when the scene has shrunk.
#include "support/contact_scene.h"
#include "support/tests.h"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

using namespace sap_test;

namespace {

// Frames in which a few geoms move.
void play(dSpaceID space, const std::vector<dGeomID>& geoms, int frames, bool contacts = false) {
  Random random(7);
  for (int frame = 0; frame < frames; ++frame) {
    for (std::size_t i = 0; i < geoms.size(); i += 1 + random.below(50)) {
      moveBy(geoms[i], random.between(-0.1, 0.1), 0, 0);
    }
    if (contacts)
      (void)parallelContacts(space, 1);
    else
      dSpaceCollide(space, nullptr, [](void*, dGeomID, dGeomID) {});
  }
}

}  // namespace

TEST_CASE("Memory goes in several frames after a scene has shrunk, and no pair with it",
          "[memory]") {
  for (const bool contacts : {false, true})
    for (const std::size_t left : {20, 400, 900}) {
      const Space space;
      dParallelSAPSpaceSetNumThreads(space, 2);
      INFO(left << " geoms left, " << (contacts ? "contacts" : "pairs"));
      World world(space, denseCube(12000, seedOr(301)));
      const std::vector<dGeomID>& geoms = world.geoms();
      const dGeomID probe = dCreateSphere(nullptr, 2);
      play(space, geoms, 3, contacts);
      for (int i = 0; i < 30; ++i) collide2(space, probe);
      const auto most = static_cast<double>(statsOf(space).memory_bytes);
      CHECK(most > 12000 * 100);
      world.shrinkTo(left);
      double before = most, most_given_back = 0;
      for (int frame = 0; frame < 160; ++frame) {
        play(space, geoms, 1, contacts);
        const auto now = static_cast<double>(statsOf(space).memory_bytes);
        most_given_back = std::max(most_given_back, before - now);
        before = now;
        if (frame < 60) REQUIRE(now > most / 4);  // it could be a pause
      }
      CHECK(before < most / 6);
      if (!contacts) CHECK(most_given_back < 0.75 * (most - before));
      for (const bool moved : {false, true, false}) {
        if (moved) dGeomSetPosition(geoms[0], 1, 1, 1);
        REQUIRE(difference(collide(space), expectedPairs(geoms)) == "");
        CHECK(collide2(space, probe).size() <= left);
      }
      dGeomDestroy(probe);
    }
}

TEST_CASE("Memory goes after a pile of pairs has come apart", "[memory]") {
  const Space space;
  World world(space, onePlace(1500, 1));
  play(space, world.geoms(), 2);
  const std::size_t most = statsOf(space).memory_bytes;
  for (std::size_t i = 0; i < 1500; ++i) dGeomSetPosition(world.geoms()[i], real(2 * i), 0, 0);
  play(space, world.geoms(), 150);
  CHECK(statsOf(space).memory_bytes < most / 4);
  CHECK(collide(space).size() < 1500);
}

TEST_CASE("Memory stays the same while the scene does, and while it breathes", "[memory]") {
  const Space space;
  World world(space, denseCube(6000, seedOr(311)));
  const auto setEnabled = [&](bool enabled) {
    for (std::size_t i = 200; i < world.geoms().size(); ++i)
      (enabled ? dGeomEnable : dGeomDisable)(world.geoms()[i]);
  };
  // What the ways of finding pairs need, whole frames and kept ones.
  for (int i = 0; i < 3; ++i) {
    play(space, world.geoms(), 20);
    setEnabled(i % 2);
  }
  setEnabled(true);
  play(space, world.geoms(), 20);
  const std::size_t memory = statsOf(space).memory_bytes;
  play(space, world.geoms(), 150);
  CHECK(statsOf(space).memory_bytes <= memory + memory / 8);
  for (int breath = 0; breath < 6; ++breath) {
    setEnabled(breath % 2);
    play(space, world.geoms(), 30);
    CHECK(statsOf(space).memory_bytes > memory / 2);
    CHECK(statsOf(space).memory_bytes <= memory + memory / 4);
  }
}

#if defined(__GLIBC__) && __GLIBC_PREREQ(2, 33)
TEST_CASE("A nested space of ten geoms takes at most 1,500 bytes of the heap", "[memory]") {
  const Space outer;
  std::vector<dSpaceID> spaces(1000);
  std::vector<dGeomID> geoms(10 * spaces.size());
  for (dGeomID& geom : geoms) geom = dCreateSphere(nullptr, 1);
  Random random(5);
  const std::size_t before = mallinfo2().uordblks;
  for (dSpaceID& space : spaces) space = dParallelSAPSpaceCreate(outer);
  for (std::size_t i = 0; i < geoms.size(); ++i) dSpaceAdd(spaces[i / 10], geoms[i]);
  const auto callback = [](void*, dGeomID a, dGeomID b) {
    if (dGeomIsSpace(a)) dSpaceCollide2(a, b, nullptr, [](void*, dGeomID, dGeomID) {});
  };
  for (int frame = 0; frame < 6; ++frame) {
    for (const dGeomID geom : geoms)
      if (frame < 3) dGeomSetPosition(geom, real(random.below(900)), 0, 0);
    for (const dSpaceID space : spaces) dSpaceCollide(space, nullptr, callback);
    dSpaceCollide2(outer.geom(), reinterpret_cast<dGeomID>(spaces[0]), nullptr, callback);
  }
  CHECK(mallinfo2().uordblks <= before + 1500 * spaces.size());
  CHECK(statsOf(spaces[0]).memory_bytes <= 1500);
}
#endif

TEST_CASE("The memory of queries goes when there are none any more", "[memory]") {
  const Space space, twin;
  World world(space, denseCube(3000, seedOr(321))), twins(twin, denseCube(3000, seedOr(321)));
  const dGeomID probe = dCreateSphere(nullptr, 1);
  collide(space);
  collide(twin);
  const std::size_t without = statsOf(space).memory_bytes;
  for (int i = 0; i < 100; ++i) collide2(space, probe);
  const std::size_t with = statsOf(space).memory_bytes;
  CHECK(with > without + 100000);
  play(space, world.geoms(), 300);
  play(twin, twins.geoms(), 300);
  CHECK(statsOf(space).memory_bytes < statsOf(twin).memory_bytes + 50000);
  CHECK(collide2(space, probe).size() < 3000);
  dGeomDestroy(probe);
}
