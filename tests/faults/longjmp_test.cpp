// Callbacks that are left by longjmp, as by an error of a scripting language: no destructor runs,
// and the space stays locked. What follows is right, and nothing hangs or leaks.
#include <csetjmp>
#include <fstream>
#include <thread>

#include "support/calls.h"
#include "support/ray_oracle.h"
#include "support/sanitizers.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

// What the callbacks do, all of them: static, as longjmp leaves no objects behind.
struct Script {
  dSpaceID space = nullptr;
  Asked asked;
  Pairs pairs;            // reported by dSpaceCollide
  long until_left = 0;    // calls; 0: it is not left
  long until_nested = 0;  // calls; 0: nothing is called within
  Call nested_call = kNear;
  std::jmp_buf back;

  void operator()(dGeomID a, dGeomID b) {
    record(&pairs, a, b);
    act();
  }
  template <class... Report>
  void operator()(Report...) {
    act();
  }
  void act() {
    if (until_left && --until_left == 0) std::longjmp(back, 1);
    if (until_nested && --until_nested == 0) report(nested_call, space, asked, *this);
  }
} script;

// Whether a callback left it.
__attribute__((noinline)) bool isLeft(Call call) {
  script.pairs.clear();
  if (setjmp(script.back)) return true;
  report(call, script.space, script.asked, script);
  return false;
}

// Such spaces stay locked, so ODE does not let go of them: they stay to the end of the program.
World& newWorld(std::size_t n) {
  static auto& worlds = *new std::vector<World*>;
  static const dGeomID probe = dCreateBox(nullptr, 4, 4, 4);
  script = Script();
  script.space = dParallelSAPSpaceCreate(nullptr);
  dParallelSAPSpaceSetNumThreads(script.space, 1);
  // Else a slow frame looks for devices, on a thread for which the C library reserves 64 MB.
  dParallelSAPSpaceSetBackend(script.space, dParallelSAPBackendCPU);
  script.asked = {probe, rayOf({-9, 1, 1}, {1, 0, 0}, 99), 3};
  worlds.push_back(new World(script.space, denseCube(n, 5)));
  return *worlds.back();
}

long virtualKilobytes() {
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * 4;
}

}  // namespace

TEST_CASE("Callbacks that are left by longjmp leave at most one frame's lists", "[longjmp]") {
  if (ADDRESS_SANITIZER) WARN("SKIPPED: the size of what is left");
  for (int call = 0; call < kCalls; ++call)
    for (const bool nested : {false, true}) {
      const World& world = newWorld(1500);
      script.nested_call = static_cast<Call>(call);
      const auto leave = [&] {
        script.until_nested = nested;
        script.until_left = nested ? 2 : 1;
        return isLeft(nested ? kNear : static_cast<Call>(call));
      };
      for (int i = 0; i < 10; ++i) REQUIRE(leave());
      const long before = virtualKilobytes();
      for (int i = 0; i < 1000; ++i) leave();
      INFO("call " << call << (nested ? ", nested" : ""));
      // The sanitizer keeps the stack's variables, and what was freed, for a while.
      if (!ADDRESS_SANITIZER) CHECK(virtualKilobytes() - before < 5000);
      script.until_left = script.until_nested = 0;
      isLeft(kNear);
      CHECK(difference(script.pairs, expectedPairs(world.geoms())) == "");
    }
}

#ifdef NDEBUG  // a debug build cannot tell a thread that left the space from one that is in it
TEST_CASE("A call that another thread left is over for the next thread, for events too",
          "[longjmp]") {
  World& world = newWorld(300);
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
