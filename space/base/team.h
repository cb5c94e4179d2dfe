// How many threads some work is given to, and what tests do to that.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {

// The work that a thread is worth its start for. tuning.h has all of them.
struct Grain {
  enum Team {
    further,  // a thread more for each so much work
    whole     // as large as may be from so much work on
  };
  std::uint64_t work;
  Team team;
  std::uint64_t alone = 0;  // less than this is done alone in any case
};

// Where tests set it, every grain is at most this, so that a few hundred geoms occupy all threads
// at every stage. 0, as it is elsewhere, leaves all as it is. One for the process.
inline std::atomic<std::uint64_t> test_grain{0};

inline bool teamsAreTested() {
  return test_grain.load(std::memory_order_relaxed) != 0;
}

inline std::uint64_t grained(std::uint64_t usual) {
  const std::uint64_t most = test_grain.load(std::memory_order_relaxed);
  return most ? std::min(usual, most) : usual;
}

constexpr int most_threads = 256;  // of a team; fixed: a promise of the header

// The threads, of `most`, that are worth their start for `work`.
inline int teamFor(std::uint64_t work, const Grain& grain, int most) {
  const std::uint64_t a_thread = grained(grain.work);
  if (work < a_thread || work < grained(grain.alone)) return 1;
  if (grain.team == Grain::whole) return most;
  return static_cast<int>(std::min<std::uint64_t>(most, work / a_thread + 1));
}

// The child of a process that had started threads has none of them: everything is done alone there.
inline std::atomic<bool> teams_are_lost{false};

inline bool teamsAreLost() {
  return teams_are_lost.load(std::memory_order_relaxed);
}

// How many threads, the calling one among them, may work in its next team: `wanted`, or fewer where
// the machine cannot provide so many, one within a team. A thread that nobody waits for starts
// OpenMP's if more are wanted than ever before. OpenMP ends the program where it cannot start one,
// so as many threads that do nothing are tried first.
int threadsToBeHad(int wanted);

// Called where there are fewer, once, on the calling thread. Null: nothing is said.
using ThreadShortageFunction = void(int granted, int wanted);
inline std::atomic<ThreadShortageFunction*> on_thread_shortage{nullptr};

// What a thread of a team takes at a time of `work`: `usual`, but in tests a quarter of its share
// where that is less.
inline std::size_t chunkOf(std::uint64_t work, std::size_t usual, int team) {
  const std::uint64_t least = test_grain.load(std::memory_order_relaxed);
  if (least == 0) return usual;
  const std::uint64_t quarter = work / (4 * static_cast<std::uint64_t>(team));
  return static_cast<std::size_t>(std::min<std::uint64_t>(usual, std::max(least, quarter)));
}

// A place in the code where a team works: one object for each, in a list of all, so that a test can
// see that none of them has only ever had one thread at work.
struct Region {
  explicit Region(const char* name) : name(name), next(first) { first = this; }
  Region(const Region&) = delete;
  Region& operator=(const Region&) = delete;

  inline static const Region* first = nullptr;
  const char* const name;
  const Region* const next;
  // How often two threads or more had work there. Counted where teams are tested.
  std::atomic<std::uint64_t> times_shared{0};
};

// The calling thread as one of its team. Used where teams are tested.
struct TeamMember {
  int team = 1;
  bool worked = false;
  const void* queue = nullptr;  // the last one that it took from
};
inline thread_local TeamMember team_member;

// Notes that the calling thread has work of its team's.
inline void noteWork() {
  if (teamsAreTested()) team_member.worked = true;
}

// To be called before a thread takes from a queue, for the first time or again. Nobody takes again
// before all of the team have come (or have been waited for long enough): of little work the first
// thread would have done all while the others wake.
void awaitTeam(std::atomic<int>& arrived, bool first);

// The members of a team, as any thread may call them.
struct Members {
  void (*call)(const void* work, int member, int team);
  const void* work;
  int count, threads;  // that may come
};

// Shares them among threads. False where more calling threads do so than there are places for.
bool shareMembers(Region& region, const Members& members);

}  // namespace ode_parallel_sap
