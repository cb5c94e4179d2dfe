#include "space/base/team.h"

#include <omp.h>
#include <pthread.h>

#include <cctype>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "space/base/platform.h"

namespace ode_parallel_sap {

namespace {

using Clock = std::chrono::steady_clock;

// Of OpenMP's threads, which has no function for it; 0: the system's usual size.
std::size_t stackSize() {
  const char* text = std::getenv("OMP_STACKSIZE");
  if (!text) text = std::getenv("GOMP_STACKSIZE");
  if (!text) return 0;
  char* unit = nullptr;
  const std::size_t number = std::strtoull(text, &unit, 10);
  while (std::isspace(static_cast<unsigned char>(*unit))) ++unit;
  switch (std::tolower(static_cast<unsigned char>(*unit))) {
    case 'b':
      return number;
    case 'm':
      return number << 20;
    case 'g':
      return number << 30;
    default:
      return number << 10;
  }
}

// A thread that ends when the gate is opened.
struct Probe {
  pthread_t thread;
  std::mutex* gate;
  long id;
  std::atomic<bool> ran{false};

  bool start(const pthread_attr_t& attributes, std::mutex& closed_gate) {
    gate = &closed_gate;
    return pthread_create(&thread, &attributes, run, this) == 0;
  }
  static void* run(void* self) {
    Probe& probe = *static_cast<Probe*>(self);
    probe.id = threadNumber();
    const std::lock_guard<std::mutex> open(*probe.gate);
    probe.ran.store(true, std::memory_order_relaxed);
    return nullptr;
  }
  void awaitEnd() {
    pthread_join(thread, nullptr);
    awaitRemoval(id);
  }
};

// How many of the wanted threads can live at the same time beside the calling one.
int countThreads(int wanted) {
  constexpr int most = 256;  // fixed: the most threads of a space
  Probe probes[most];
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  if (const std::size_t size = stackSize()) pthread_attr_setstacksize(&attributes, size);
  std::mutex gate;
  gate.lock();
  int count = 0;
  while (count < std::min(wanted, most) && probes[count].start(attributes, gate)) ++count;
  gate.unlock();
  pthread_attr_destroy(&attributes);
  const Clock::time_point end = Clock::now() + std::chrono::milliseconds(2);
  // At first without sleeping: a thread without a core of its own would run on this one meanwhile.
  for (int i = 0; i < count; ++i)
    while (!probes[i].ran.load(std::memory_order_relaxed) && Clock::now() < end) continue;
  for (int i = 0; i < count; ++i) probes[i].awaitEnd();
  return count;
}

// Leaves OpenMP with a team of the size that it returns; 0 where the threads for it are waited for
// too long. Calling threads take turns: what one has counted, no other may take before OpenMP has
// it. One thread more than needed is counted, so that the rest of the program has one left.
int startTeam(int wanted) {
  static std::mutex turn;
  const std::lock_guard<std::mutex> own_turn(turn);
  int granted = 1;
  // A single one first: on a busy host each further one is waited for as well.
  for (const int count : {1, wanted}) {
    const Clock::time_point begin = Clock::now();
    granted = std::max(1, countThreads(count));
    team_times.add(count, 0,
                   std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    if (team_times.stalled()) return 0;
  }
  std::atomic<int> started{0};
#pragma omp parallel num_threads(granted)
  started.fetch_add(1, std::memory_order_relaxed);
  return granted;
}

}  // namespace

void expectChildren() {
  static std::atomic<bool> expected{false};
  if (expected.load(std::memory_order_relaxed) || expected.exchange(true)) return;
  onFork(nullptr, nullptr, [] { teams_are_lost.store(true, std::memory_order_relaxed); });
}

int threadsToBeHad(int wanted) {
  thread_local int sought = 1, granted = 1;
  if (wanted > sought) {
    // A team within a team has one thread, and OpenMP starts none for it.
    if (omp_get_active_level() >= omp_get_max_active_levels()) return 1;
    expectChildren();
    const int started = startTeam(wanted);
    if (started == 0) return 1;
    granted = started;
    sought = wanted;
    static std::atomic<bool> said{false};
    ThreadShortageFunction* const say = on_thread_shortage.load(std::memory_order_relaxed);
    if (granted < wanted && say && !said.exchange(true)) say(granted, wanted);
  }
  return std::min(wanted, granted);
}

// Nothing here orders what threads do: a sanitizer is to see all that they do at once.
void awaitTeam(std::atomic<int>& arrived) {
  const int team = team_member.team;
  if (team == 1) return;
  if (team_member.queue != &arrived) {
    team_member.queue = &arrived;
    arrived.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  constexpr std::chrono::milliseconds longest_wait(100);
  if (arrived.load(std::memory_order_relaxed) >= team) return;
  const Clock::time_point end = Clock::now() + longest_wait;
  while (arrived.load(std::memory_order_relaxed) < team && Clock::now() < end)
    std::this_thread::yield();
  if (arrived.load(std::memory_order_relaxed) < team)
    arrived.fetch_add(team, std::memory_order_relaxed);  // nobody waits again
}

}  // namespace ode_parallel_sap
