// Callbacks that are left by longjmp, as by an error of a scripting language: no destructor runs,
// and the space stays locked. What follows is right, and nothing hangs or leaks.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <csetjmp>
#include <fstream>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/oracle.h"
#include "support/recorder.h"
#include "support/sanitizers.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

// All that calls back.
enum Way { kNear, kPairs, kContacts, kQuery, kRays, kOverlaps, kWays };

// What the callbacks do, all of them: static, as longjmp leaves no objects behind.
struct Script {
  dSpaceID space = nullptr;
  dGeomID probe = nullptr;
  Pairs pairs;            // that were reported to the outermost callback
  long until_left = 0;    // calls; 0: it is not left
  long until_nested = 0;  // calls; 0: nothing is collided within
  Way nested_way = kNear;
  bool nested = false;
  std::jmp_buf back;
} script;

void collideBy(Way way);

void called(dGeomID a, dGeomID b) {
  if (!script.nested && b) script.pairs.emplace_back(number(a), number(b));
  if (script.until_left && --script.until_left == 0) std::longjmp(script.back, 1);
  if (script.until_nested && --script.until_nested == 0) {
    script.nested = true;
    collideBy(script.nested_way);
    script.nested = false;
  }
}

void near(void*, dGeomID a, dGeomID b) {
  called(a, b);
}

void block(void*, const dParallelSAPPair* pairs, size_t count, size_t) {
  for (size_t i = 0; i < count; ++i) called(pairs[i].o1, pairs[i].o2);
}

void touch(void*, dGeomID a, dGeomID b, const dContactGeom*, int) {
  called(a, b);
}

void hit(void*, size_t, const dParallelSAPRayHit*, size_t) {
  called(nullptr, nullptr);
}

void overlap(void*, size_t, dGeomID, const dContactGeom*, int) {
  called(nullptr, nullptr);
}

void collideBy(Way way) {
  dParallelSAPProbe probe = {script.probe, nullptr, 0};
  const dParallelSAPContactCallbacks contacts = {touch, nullptr, nullptr, nullptr};
  const dParallelSAPRay rays[3] = {{{-9, 1, 1}, {1, 0, 0}, 99, ~0ul, ~0ul, nullptr},
                                   {{-9, 2, 1}, {1, 0, 0}, 99, ~0ul, ~0ul, nullptr},
                                   {{-9, 3, 2}, {1, 0, 0}, 99, ~0ul, ~0ul, nullptr}};
  switch (way) {
    case kNear:
      return dSpaceCollide(script.space, nullptr, near);
    case kPairs:
      return dParallelSAPSpaceCollidePairs(script.space, nullptr, 0, block);
    case kContacts:
      return dParallelSAPSpaceCollideContacts(script.space, nullptr, 4, &contacts);
    case kQuery:
      return dSpaceCollide2(asGeom(script.space), script.probe, nullptr, near);
    case kOverlaps:
      dParallelSAPSpaceOverlaps(script.space, &probe, 1, sizeof probe, 1, nullptr, overlap);
      return;
    default:
      dParallelSAPSpaceRayHits(script.space, rays, 3, 1, nullptr, hit);
  }
}

// Whether a callback left it.
__attribute__((noinline)) bool isLeft(Way way) {
  script.pairs.clear();
  script.nested = false;
  if (setjmp(script.back)) return true;
  collideBy(way);
  return false;
}

// Such spaces stay locked, so ODE does not let go of them: they stay to the end of the program.
std::vector<World*>& worlds() {
  static auto& all = *new std::vector<World*>;
  return all;
}

World& newWorld(std::size_t n, int threads) {
  script = Script();
  script.space = dParallelSAPSpaceCreate(nullptr);
  dParallelSAPSpaceSetNumThreads(script.space, threads);
  // Else a slow frame looks for devices, on a thread for which the C library reserves 64 MB.
  dParallelSAPSpaceSetBackend(script.space, dParallelSAPBackendCPU);
  worlds().push_back(new World(script.space));
  World& world = *worlds().back();
  world.addBoxes(denseCube(n, 5));
  static const dGeomID probe = dCreateBox(nullptr, 4, 4, 4);
  script.probe = probe;
  return world;
}

long virtualKilobytes() {
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * 4;
}

}  // namespace

TEST_CASE("Callbacks that are left by longjmp leave at most one frame's lists", "[longjmp]") {
  if (ADDRESS_SANITIZER) WARN("SKIPPED: the size of what is left");
  for (int way = 0; way < kWays; ++way)
    for (const bool nested : {false, true}) {
      newWorld(1500, 1);
      script.nested_way = static_cast<Way>(way);
      const Way outer = nested ? kNear : static_cast<Way>(way);
      const auto leave = [&] {
        script.until_nested = nested;
        script.until_left = nested ? 2 : 1;
        return isLeft(outer);
      };
      for (int i = 0; i < 10; ++i) REQUIRE(leave());
      const long before = virtualKilobytes();
      for (int i = 0; i < 1000; ++i) leave();
      INFO("way " << way << (nested ? ", nested" : ""));
      // The sanitizer keeps the stack's variables, and what was freed, for a while.
      if (!ADDRESS_SANITIZER) CHECK(virtualKilobytes() - before < 5000);
      script.until_left = script.until_nested = 0;
      isLeft(kNear);
      CHECK(difference(script.pairs, expectedPairs(worlds().back()->geoms())) == "");
    }
}

#ifdef NDEBUG  // a debug build cannot tell a thread that left the space from one that is in it
TEST_CASE("A call that another thread left is over for the next thread, for events too",
          "[longjmp]") {
  World& world = newWorld(300, 1);
  dParallelSAPSpaceSetEvents(script.space, 1);
  script.until_left = 1;
  std::thread([] { isLeft(kNear); }).join();
  const dParallelSAPPairEvent* pairs;
  dGeomDisable(world.geoms()[7]);
  isLeft(kNear);
  CHECK(dParallelSAPSpaceGetEndedPairs(script.space, &pairs) > 0);
  isLeft(kNear);
  CHECK(dParallelSAPSpaceGetBegunPairs(script.space, &pairs) == 0);
  CHECK(dParallelSAPSpaceGetEndedPairs(script.space, &pairs) == 0);
}
#endif
