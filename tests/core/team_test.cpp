// When a parallel region ends: with its work, not with its threads.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "space/base/parallel.h"
#include "support/catch.hpp"
#include "support/sanitizers.h"

#if defined(__linux__)
#include <dirent.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#endif

using namespace ode_parallel_sap;

namespace {

using Milliseconds = std::chrono::duration<double, std::milli>;

// Whether several threads worked in a region within some seconds. They are started while regions go
// on without them.
bool comeToHelp(Region& region, int threads) {
  for (int trial = 0; trial < 5000; ++trial) {
    std::atomic<int> others{0};
    const std::thread::id caller = std::this_thread::get_id();
    runTeam(region, threads, [&](int, int) {
      others += std::this_thread::get_id() != caller;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    });
    if (others) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("A team is waited for that has begun, and calls each member once, the caller its first") {
  static Region region("team");
  REQUIRE((threadsToBeHad(4) == 1 || comeToHelp(region, 4)));
  for (const int team : {1, 2, 7, 16, 65, most_threads}) {
    std::vector<std::atomic<int>> begun(static_cast<std::size_t>(team)), done(begun.size());
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<bool> is_first{false};
    runTeam(region, team, [&](int member, int) {
      ++begun[member];
      if (member == 0) is_first = std::this_thread::get_id() == caller;
      if (member == team / 2) std::this_thread::sleep_for(std::chrono::milliseconds(20));
      ++done[member];
    });
    const auto isOne = [](const std::atomic<int>& times) { return times == 1; };
    CHECK(is_first);
    CHECK(std::all_of(begun.begin(), begun.end(), isOne));
    CHECK(std::all_of(done.begin(), done.end(), isOne));
  }
}

TEST_CASE("Several calling threads share the workers") {
  static Region region("callers");
  std::atomic<int> wrong{0};
  std::vector<std::thread> callers;
  for (int caller = 0; caller < 12; ++caller)
    callers.emplace_back([&] {
      for (int round = 0; round < 300; ++round) {
        std::atomic<int> sum{0};
        const auto work = [&](int member, int) {
          sum += member;
          if (round % 100 == 7 && member == 3) throw std::runtime_error("3");
          runTeam(region, 4, [&](int, int) { ++sum; });
        };
        bool thrown = false;
        try {
          runTeam(region, 4, work);
        } catch (const std::runtime_error&) {
          thrown = true;
        }
        wrong += thrown != (round % 100 == 7) || (!thrown && sum != 6 + 16);
      }
    });
  for (std::thread& caller : callers) caller.join();
  CHECK(wrong == 0);
}

// A process of its own.
TEST_CASE("A program may end while threads are being started", "[.][exit]") {
  static Region region("exit");
  CHECK(runTeam(region, 16, [](int, int) {}) > 1);
}

#if defined(__linux__) && !THREAD_SANITIZER  // which lets no child start threads
// Processes of their own: threads stay as late as they are made, and children have none of those
// that were started.
TEST_CASE("A thread that comes late delays no region", "[.][late]") {
  static Region region("late");
  REQUIRE(comeToHelp(region, 8));
  // All but the calling thread get only what four others leave of a core.
  cpu_set_t cores, one;
  REQUIRE(sched_getaffinity(0, sizeof cores, &cores) == 0);
  CPU_ZERO(&one);
  for (int core = 0; core < CPU_SETSIZE && !CPU_COUNT(&one); ++core)
    if (CPU_ISSET(core, &cores)) CPU_SET(core, &one);
  DIR* const tasks = opendir("/proc/self/task");
  while (const dirent* const task = readdir(tasks))
    if (const int id = std::atoi(task->d_name)) {
      const sched_param none = {};
      REQUIRE(sched_setaffinity(id, sizeof one, &one) == 0);
      if (id != getpid()) REQUIRE(sched_setscheduler(id, SCHED_IDLE, &none) == 0);
    }
  closedir(tasks);
  std::atomic<bool> over{false};
  std::vector<std::thread> others;
  for (int i = 0; i < 4; ++i)
    others.emplace_back([&] {
      while (!over) continue;
    });
  std::vector<double> ms;
  for (int frame = 0; frame < 20; ++frame) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const auto begin = std::chrono::steady_clock::now();
    runTeam(region, 8, [](int, int) {});
    ms.push_back(Milliseconds(std::chrono::steady_clock::now() - begin).count());
  }
  over = true;
  for (std::thread& other : others) other.join();
  std::nth_element(ms.begin(), ms.begin() + 10, ms.end());
  CHECK(ms[10] < 1);
}

TEST_CASE("A child has threads of its own, whatever its parent did with OpenMP", "[.][fork]") {
  std::atomic<int> ran{0};
#pragma omp parallel num_threads(4)
  ran += 1;
  REQUIRE(ran > 0);
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);
    static Region region("child");
    _exit(comeToHelp(region, 4) ? 0 : 1);
  }
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(status == 0);
}
#endif
