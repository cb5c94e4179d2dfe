#include "space/data/team.h"

#include <pthread.h>

#include <chrono>
#include <thread>

namespace ode_parallel_sap {

namespace {

thread_local TeamWatch::Member* own = nullptr;

}  // namespace

void expectChildren() {
  static std::atomic<bool> expected{false};
  if (expected.load(std::memory_order_relaxed) || expected.exchange(true)) return;
  pthread_atfork(nullptr, nullptr, [] { teams_are_lost.store(true, std::memory_order_relaxed); });
}

void TeamWatch::Member::enter(int team) {
  team_ = team;
  outer_ = own;
  own = this;
}

void TeamWatch::Member::leave() {
  own = outer_;
  if (worked_) watch_.workers_.fetch_add(1, std::memory_order_relaxed);
}

void TeamWatch::noteOwnWork() {
  if (own) own->worked_ = true;
}

// Nothing here orders what threads do: a sanitizer is to see all that they do at once.
void TeamWatch::awaitOthers(std::atomic<int>& arrived) {
  using Clock = std::chrono::steady_clock;
  if (!own) return;
  if (own->queue_ != &arrived) {
    own->queue_ = &arrived;
    arrived.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  constexpr std::chrono::milliseconds longest_wait(100);
  if (arrived.load(std::memory_order_relaxed) >= own->team_) return;
  const Clock::time_point end = Clock::now() + longest_wait;
  while (arrived.load(std::memory_order_relaxed) < own->team_ && Clock::now() < end)
    std::this_thread::yield();
  if (arrived.load(std::memory_order_relaxed) < own->team_)
    arrived.fetch_add(own->team_, std::memory_order_relaxed);  // nobody waits again
}

}  // namespace ode_parallel_sap
