// The one way work is given to threads here: how many take it, and what tests do to that.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

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

// What a thread takes at a time of `work`: `usual`, but in tests at most a quarter of its share.
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

// A range of indices, half open.
struct Range {
  std::size_t begin, end;
};

// The part-th of `parts` parts of [0, count), sizes differing by one at most, begins rounded down
// to a multiple of `step`.
inline Range partOf(std::size_t count, int part, int parts, std::size_t step = 1) {
  // Quotient and remainder apart: the product of both could overflow.
  const auto cut = [=](std::size_t p) {
    const std::size_t n = static_cast<std::size_t>(parts);
    return p == n ? count : (count / n * p + count % n * p / n) / step * step;
  };
  return {cut(part), cut(part + 1)};
}

// The same of a thread of a team.
inline Range ownPart(std::size_t count, int part, int parts) {
  const Range range = partOf(count, part, parts);
  if (range.begin < range.end) noteWork();
  return range;
}

// Calls work(member, team) once for each of the members 0 to team-1 of a team of `threads` (1 to
// most_threads). The calling thread takes members until none is left, other threads take some
// meanwhile, and those that were begun are waited for: a thread that comes late finds nothing. So
// one thread may be several members, one after the other. All run in the calling thread's
// floating-point mode. The first exception of any member is thrown again, a lack of memory only if
// there is no other: those of the program's functions must not be lost. Returns how many threads
// may have worked.
template <class Work>
int runTeam(Region& region, int threads, Work&& work) {
  const int team = std::clamp(threads, 1, most_threads);
  const int available = team > 1 ? threadsToBeHad(team) : 1;
  const auto call = [](const void* all, int member, int size) {
    (*static_cast<std::remove_reference_t<Work>*>(const_cast<void*>(all)))(member, size);
  };
  if (available > 1 && shareMembers(region, {call, &work, team, available})) return available;
  for (int member = 0; member < team; ++member) work(member, team);
  return 1;
}

// Chunks of [0, count) handed out to threads as they come. With several parts each thread takes the
// chunks of its own part in their order, and only then what is left of others'. What neighbours
// share is read by one thread once, instead of by all of them at different times, and lists that
// threads make hold neighbours side by side.
class ChunkQueue {
 public:
  ChunkQueue(std::size_t count, std::size_t chunk, int parts = 1)
      : chunk_(chunk), parts_(std::clamp(parts, 1, most_parts)) {
    for (int part = 0; part < parts_; ++part) {
      const Range range = partOf(count, part, parts_, chunk);
      queue_[part].next.store(range.begin, std::memory_order_relaxed);
      queue_[part].end = range.end;
    }
  }
  // False when nothing is left.
  bool next(Range& range, int thread = 0) {
    if (teamsAreTested()) awaitTeam(arrived_, std::exchange(team_member.queue, this) != this);
    for (int i = 0; i < parts_; ++i) {
      Part& part = queue_[(thread + i) % parts_];
      // Reads first: a part that is empty stays in all caches.
      if (part.next.load(std::memory_order_relaxed) >= part.end) continue;
      const std::size_t begin = part.next.fetch_add(chunk_, std::memory_order_relaxed);
      if (begin >= part.end) continue;
      range = {begin, std::min(begin + chunk_, part.end)};
      noteWork();
      return true;
    }
    return false;
  }

 private:
  struct alignas(64) Part {
    std::atomic<std::size_t> next;
    std::size_t end;
  };

  static constexpr int most_parts = 64;  // fixed: 4 KB; larger teams share them
  const std::size_t chunk_;
  const int parts_;
  std::atomic<int> arrived_{0};  // threads; counted in tests
  Part queue_[most_parts];       // those beyond parts_ are never touched
};

// Calls work(range, thread) for all chunks of [0, count), which a team's threads take as they come,
// each from its own one of several parts first.
template <class Work>
int runChunks(Region& region, int threads, std::size_t count, std::size_t chunk, const Work& work,
              int parts = 1) {
  ChunkQueue queue(count, chunk, parts);
  return runTeam(region, threads, [&](int thread, int) {
    for (Range range; queue.next(range, thread);) work(range, thread);
  });
}

}  // namespace ode_parallel_sap
