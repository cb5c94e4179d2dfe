// The one way threads are started here: an OpenMP team that survives exceptions.
#pragma once

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <new>

#include "space/base/floating_point.h"
#include "space/base/team.h"

namespace ode_parallel_sap {

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
inline Range ownPart(std::size_t count, int part, int parts, std::size_t step = 1) {
  const Range range = partOf(count, part, parts, step);
  if (range.begin < range.end) noteWork();
  return range;
}

// Calls work(thread, team) once on each of up to `threads` threads (fewer if OpenMP or the machine
// grants fewer, one in the child of a process that had teams, or once teams have stalled) and
// returns when all are done. All run in the calling thread's floating-point mode: OpenMP's threads
// would otherwise keep the one they were born with. The first exception of any thread is thrown
// again on the caller's, a lack of memory only if there is no other: those of the program's
// functions must not be lost. Returns the team's size.
template <class Work>
int runTeam(Region& region, int threads, Work&& work) {
  if (threads > 1) threads = teamsAreLost() || team_times.stalled() ? 1 : threadsToBeHad(threads);
  if (threads <= 1) {
    work(0, 1);
    return 1;
  }
  const FloatingPointMode mode = currentMode();
  std::exception_ptr failure, no_memory;
  std::atomic_flag failed = ATOMIC_FLAG_INIT, lacked = ATOMIC_FLAG_INIT;
  std::atomic<int> workers{0};
  int team = 1;
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::duration<double, std::milli>;
  const Clock::time_point begin = Clock::now();
  Milliseconds worked(0);
#pragma omp parallel num_threads(threads)
  {
    const ScopedMode callers_mode(mode);
    const int thread = omp_get_thread_num(), size = omp_get_num_threads();
    team_member = {size};
    if (thread == 0) team = size;
    const Clock::time_point work_begin = Clock::now();
    try {
      work(thread, size);
    } catch (const std::bad_alloc&) {
      if (!lacked.test_and_set()) no_memory = std::current_exception();
    } catch (...) {
      if (!failed.test_and_set()) failure = std::current_exception();
    }
    if (thread == 0) worked = Clock::now() - work_begin;
    workers += team_member.worked;
    team_member = {};
  }
  if (workers > 1) region.times_shared.fetch_add(1, std::memory_order_relaxed);
  team_times.add(team, worked.count(), Milliseconds(Clock::now() - begin - worked).count());
  if (failure || no_memory) std::rethrow_exception(failure ? failure : no_memory);
  return team;
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
    if (teamsAreTested()) awaitTeam(arrived_);
    for (int i = 0; i < parts_; ++i)
      if (takeFrom(queue_[(thread + i) % parts_], range)) {
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

  // Reads first: a part that is empty stays in all caches.
  bool takeFrom(Part& part, Range& range) {
    if (part.next.load(std::memory_order_relaxed) >= part.end) return false;
    const std::size_t begin = part.next.fetch_add(chunk_, std::memory_order_relaxed);
    if (begin >= part.end) return false;
    range = {begin, std::min(begin + chunk_, part.end)};
    return true;
  }

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
