// What the header says that a setting does or a statistic tells, by its effect.
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <thread>

#include "support/calls.h"
#include "support/ray_oracle.h"
#include "support/sanitizers.h"
#include "support/tests.h"
#include "support/user_box.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

constexpr int kNapMs = 5;

void nap(int times = 1) {
  std::this_thread::sleep_for(std::chrono::milliseconds(times * kNapMs));
}

// Collides a space whose callback sleeps in its first call.
void collideAsleep(dSpaceID space) {
  int calls = 0;
  dSpaceCollide(space, &calls, [](void* calls, dGeomID, dGeomID) {
    if ((*static_cast<int*>(calls))++ == 0) nap();
  });
}

}  // namespace

TEST_CASE("The times of the stages are those of what was done in them", "[effects]") {
  for (const std::size_t n : {20, 3000}) {
    const bool is_small = n < 100;
    const Space space(on_cpu);
    World world(space, denseCube(n, 1));
    (void)statsOf(space);  // from now on small scenes are timed
    INFO(n << " geoms");

    collideAsleep(space);
    dParallelSAPStats stats = statsOf(space);
    CHECK(stats.report_ms >= kNapMs);
    CHECK(stats.total_ms >= stats.report_ms);
    CHECK(stats.extract_ms > 0);
    CHECK(stats.narrow_ms == 0);
    if (!is_small) {
      CHECK(stats.update_ms > 0);
      CHECK(stats.filter_ms == 0);

      // Where nothing changed these have nothing to do, whatever the bits.
      constexpr unsigned long top = 1ul << (8 * sizeof(long) - 1);
      for (const unsigned long bits : {~0ul, 1ul, top, ~top, ~(1ul << 31)}) {
        dGeomSetCategoryBits(world.geoms()[0], bits);
        for (int frame = 0; frame < 3; ++frame) (void)collide(space);
        stats = statsOf(space);
        INFO("bits " << bits);
        CHECK(stats.pairs > 0);
        CHECK(stats.kept == stats.pairs);
        CHECK(stats.extract_ms == 0);
        CHECK(stats.filter_ms == 0);
        CHECK(stats.update_ms > 0);
        CHECK(stats.report_ms > 0);
      }
      dGeomSetCategoryBits(world.geoms()[0], ~0ul);
    }

    // Functions of user classes: the bounds' are part of the update, the pairs' of the filter.
    const dReal far = 500;
    const Bounds bounds = {far, far + 1, far, far + 1, far, far + 1};
    const auto veto = [](dGeomID, dGeomID, dReal*) {
      nap();
      return 1;
    };
    world.take(createUserBox(space, bounds, false, veto));
    world.take(createUserBoxWithoutTest(space, bounds));
    for (int frame = 0; frame < 16; ++frame) (void)collide(space);  // one of which is timed
    stats = statsOf(space);
    CHECK((is_small ? stats.extract_ms : stats.filter_ms) >= kNapMs);
    CHECK(stats.report_ms < stats.total_ms);

    const auto sleepInFlags = [](void*, dGeomID, dGeomID) {
      nap();
      return 1;
    };
    const auto sleepInReport = [](void* data, dGeomID, dGeomID, const dContactGeom*, int) {
      if ((*static_cast<int*>(data))++ == 0) nap(4);
    };
    const auto sleepInBlock = [](void*, const dParallelSAPPair*, std::size_t, std::size_t first) {
      if (first == 0) nap();
    };
    for (const int flags : {0, int(dParallelSAPPairsConcurrent)}) {
      const unsigned long long pairs = stats.pairs;
      for (int frame = 0; frame < 16; ++frame)
        dParallelSAPSpaceCollidePairs(space, nullptr, flags, sleepInBlock);
      stats = statsOf(space);
      CHECK(stats.pairs == pairs);
      CHECK(stats.report_ms >= kNapMs);
      CHECK(stats.total_ms >= stats.report_ms);
    }

    for (std::size_t i = 30; i < n; ++i) dGeomDisable(world.geoms()[i]);
    int calls = 0;
    dParallelSAPContactCallbacks callbacks = {sleepInReport, sleepInFlags, nullptr, nullptr};
    dParallelSAPSpaceCollideContacts(space, &calls, 0, &callbacks);
    stats = statsOf(space);
    CHECK(calls > 0);
    CHECK(stats.contacts == static_cast<unsigned long long>(calls));
    CHECK(stats.narrow_ms >= kNapMs);
    CHECK(stats.report_ms >= 4 * kNapMs);
    CHECK(stats.total_ms >= stats.narrow_ms + stats.report_ms);
  }
}

TEST_CASE("Small scenes are timed once statistics were asked for, in every sixteenth frame",
          "[effects]") {
  const Space space;
  World world(space, denseCube(60, 2));
  for (int frame = 0; frame < 20; ++frame) (void)collide(space);
  CHECK(statsOf(space).total_ms == 0);
  double last = 0;
  for (int frame = 0; frame < 64; ++frame) {
    collideAsleep(space);
    const dParallelSAPStats stats = statsOf(space);
    INFO("frame " << frame);
    CHECK((stats.total_ms != last) == (frame % 16 == 0));
    CHECK(stats.frames == 21u + static_cast<unsigned>(frame));
    last = stats.total_ms;
  }
  CHECK(last >= kNapMs);
}

namespace {

// What the functions of a user class see of the space they are called for.
struct Witness {
  std::thread::id thread;
  dGeomID inside;  // of the space
  std::size_t calls = 0, elsewhere = 0, unlocked = 0, late = 0;
  std::atomic<bool> reporting{false};

  void look() {
    ++calls;
    elsewhere += std::this_thread::get_id() != thread;
    late += reporting;
    bool locked = false;
    try {
      dSpaceRemove(dGeomGetSpace(inside), inside);
    } catch (const OdeAssertion&) {
      locked = true;
    }
    unlocked += !locked;
  }
};
Witness* witness = nullptr;

int lookAndPass(dGeomID, dGeomID, dReal*) {
  witness->look();
  return 1;
}

}  // namespace

TEST_CASE("Functions of user classes run on the calling thread, locked, before any report",
          "[effects]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {20, 6000}) {
      const Space space(configuration);
      dParallelSAPSpaceSetNumThreads(space, 3);
      World world(space);
      // Boxes among them have contacts and are hit by rays.
      for (const Box& box : denseCube(n, 5))
        if (world.geoms().size() % 4 == 0)
          world.addBox(box);
        else
          world.take(createUserBox(space,
                                   {real(box.low[0]), real(box.high[0]), real(box.low[1]),
                                    real(box.high[1]), real(box.low[2]), real(box.high[2])},
                                   false, lookAndPass));
      const dGeomID probe = createUserBox(nullptr, {-9, 99, -9, 99, -9, 99}, false, lookAndPass);
      const Space others;
      // At the middle of a box.
      const dReal* const at = dGeomGetPosition(world.geoms()[0]);
      const dParallelSAPRay ray = rayOf({at[0] - 50, at[1], at[2]}, {1, 0, 0}, 1e3);
      const dGeomID ball = dCreateSphere(others, 9);
      for (int i = 0; i < kCalls; ++i) {
        world.jitter(0, 1);                // all are to be asked for their bounds
        dGeomSetPosition(probe, 0, 0, 0);  // likewise
        Witness seen;
        seen.thread = std::this_thread::get_id();
        seen.inside = world.geoms()[0];
        witness = &seen;
        setUserBoundsObserver([] { witness->look(); });
        auto reported = [&](auto...) { seen.reporting = true; };
        // The probe has no collider, so balls are reported before it.
        report(static_cast<Call>(i), space, {i == kOverlaps ? ball : probe, ray, 300, probe},
               reported);
        setUserBoundsObserver(nullptr);
        witness = nullptr;
        INFO(configuration.name << ", " << n << " geoms, call " << i);
        CHECK(seen.calls > n);
        CHECK(seen.reporting);
        CHECK(seen.elsewhere == 0);
        CHECK(seen.unlocked == 0);
        CHECK(seen.late == 0);
      }
      dGeomDestroy(probe);
    }
}

TEST_CASE(
    "Auto is brute force for up to some 200 geoms, then the sweep; some thousand use one thread",
    "[effects]") {
  for (const int method : {dParallelSAPMethodAuto, dParallelSAPMethodSweep})
    for (const std::size_t n : {3, 100, 180, 220, 1000, 4000}) {
      const Space space(on_cpu);
      dParallelSAPSpaceSetMethod(space, method);
      dParallelSAPSpaceSetNumThreads(space, 7);
      World world(space, denseCube(n, 6));
      (void)collide(space);
      INFO(n << " geoms");
      const bool tests_all = method == dParallelSAPMethodAuto && n < 200;
      CHECK(statsOf(space).method ==
            (tests_all ? dParallelSAPMethodBruteForce : dParallelSAPMethodSweep));
      CHECK(statsOf(space).threads == 1);
    }
}

TEST_CASE("Auto is brute force for up to 500 geoms while all of them are in one place",
          "[effects]") {
  for (const std::size_t n : {220, 500, 520}) {
    const Space space(on_cpu);
    World world(space, onePlace(n, 6));
    const auto methodAt = [&](double x, double distance) {
      for (std::size_t i = 0; i < n; ++i)
        dGeomSetPosition(world.geoms()[i], (i % 2 ? x : -x) + distance * static_cast<double>(i), 0,
                         0);
      (void)collide(space);
      return statsOf(space).method;
    };
    INFO(n << " geoms");
    const int crowded = n > 500 ? dParallelSAPMethodSweep : dParallelSAPMethodBruteForce;
    CHECK(methodAt(1, 0) == dParallelSAPMethodSweep);  // which finds out
    CHECK(methodAt(2, 0) == crowded);
    CHECK(methodAt(3, 0) == crowded);
    CHECK(methodAt(4, 2) == crowded);
    CHECK(methodAt(5, 2) == dParallelSAPMethodSweep);
  }
}

TEST_CASE("A number of threads that is not set is OpenMP's", "[effects]") {
  const char* const threads = std::getenv("OMP_NUM_THREADS");  // CTest runs this with 1 and with 2
  if (!threads) return;
  const Variable tested("ODE_PARALLEL_SAP_TEST_GRAIN", "1");  // on a busy host, too
  const Space space(on_cpu);
  dParallelSAPSpaceSetMethod(space, dParallelSAPMethodSweep);
  REQUIRE(dParallelSAPSpaceGetNumThreads(space) == 0);
  World world(space, denseCube(50000, 7));
  int most = 0;
  for (int frame = 0; frame < 3; ++frame) {
    world.jitter(1, 7);
    (void)collide(space);
    most = std::max(most, statsOf(space).threads);
  }
  CHECK(most == std::atoi(threads));
}

#if !THREAD_SANITIZER  // which does not know what becomes of OpenMP's threads
TEST_CASE("After a fork the child goes on alone, whatever number of threads is set", "[effects]") {
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, 2);
  World world(space, denseCube(20000, 8));
  const Pairs pairs = collide(space);
  CHECK(statsOf(space).threads == 2);
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);
    world.jitter(0.1, 8);
    const Pairs moved = collide(space);
    const bool alone = statsOf(space).threads == 1;
    Space other;
    dParallelSAPSpaceSetNumThreads(other, 3);
    World fresh(other, denseCube(20000, 8));
    const bool same = collide(other).size() == pairs.size();
    for (const dGeomID geom : world.geoms()) dGeomDisable(geom);
    const bool other_pairs = !moved.empty() && moved != pairs;
    _exit(other_pairs && alone && same && collide(space).empty() ? 0 : 1);
  }
  REQUIRE(child > 0);
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(status == 0);
  CHECK(difference(collide(space), pairs) == "");
}
#endif

namespace {

// Spaces in `space`, `wide` in each, down to `deep` levels; geoms of the lowest.
void nest(dSpaceID space, int wide, int deep, std::vector<dGeomID>& geoms) {
  if (deep == 0) {
    geoms.push_back(dCreateSphere(space, dReal(0.1)));
    dGeomSetPosition(geoms.back(), real(geoms.size()), 0, 0);
    return;
  }
  for (int i = 0; i < wide; ++i) nest(dParallelSAPSpaceCreate(space), wide, deep - 1, geoms);
}

// The processor's time of a frame in which one geom moves.
double pathTime(int wide, int deep) {
  const Space top;
  std::vector<dGeomID> geoms;
  nest(top, wide, deep, geoms);
  double least = 1e9;
  Pairs pairs;
  for (int frame = 0; frame < 100; ++frame) {
    const dGeomID geom = geoms[geoms.size() / 2];
    dGeomSetPosition(geom, dGeomGetPosition(geom)[0], frame % 2 ? 1 : 0, 0);
    timespec begin, end;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
    dSpaceCollide(top, &pairs, recordWithin);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
    least = std::min(least, static_cast<double>(end.tv_sec - begin.tv_sec) +
                                1e-9 * static_cast<double>(end.tv_nsec - begin.tv_nsec));
  }
  return least;
}

}  // namespace

TEST_CASE("A frame in which one geom of nested spaces moves takes time for its path", "[effects]") {
  CHECK(pathTime(2, 11) < 8 * pathTime(2, 5));  // of 2,048 and 32 spaces
  CHECK(pathTime(1, 800) < 12 * pathTime(1, 200));
}
