// The one way threads are started here: an OpenMP team that survives exceptions.
#pragma once

#include <omp.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>

#include "space/data/floating_point.h"
#include "space/data/team.h"

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
  if (range.begin < range.end) TeamWatch::noteWork();
  return range;
}

// Calls work(thread, team) once on each of up to `threads` threads (fewer if OpenMP grants fewer,
// one in the child of a process that had teams) and returns when all are done. All run in the
// calling thread's floating-point mode: OpenMP's threads would otherwise keep the one they were
// born with. The first exception of any thread is thrown again on the caller's. Returns the team's
// size.
template <class Work>
int runTeam(Region& region, int threads, Work&& work) {
  if (threads <= 1 || teamsAreLost()) {
    work(0, 1);
    return 1;
  }
  expectChildren();
  const FloatingPointMode mode = currentMode();
  std::exception_ptr failure;
  std::atomic_flag failed = ATOMIC_FLAG_INIT;
  TeamWatch watch(region);
  int team = 1;
#pragma omp parallel num_threads(threads)
  {
    const ScopedMode callers_mode(mode);
    const int thread = omp_get_thread_num(), size = omp_get_num_threads();
    const TeamWatch::Member member(watch, size);
    if (thread == 0) team = size;
    try {
      work(thread, size);
    } catch (...) {
      if (!failed.test_and_set()) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
  return team;
}

// Chunks of [0, count) handed out to whoever asks next.
class ChunkQueue {
 public:
  ChunkQueue(std::size_t count, std::size_t chunk) : count_(count), chunk_(chunk) {}
  // False when nothing is left.
  bool next(Range& range) {
    TeamWatch::takeTurn(arrived_);
    const std::size_t begin = next_.fetch_add(chunk_, std::memory_order_relaxed);
    if (begin >= count_) return false;
    range = {begin, begin + chunk_ < count_ ? begin + chunk_ : count_};
    TeamWatch::noteWork();
    return true;
  }

 private:
  const std::size_t count_, chunk_;
  std::atomic<int> arrived_{0};  // threads; counted in tests
  alignas(64) std::atomic<std::size_t> next_{0};
};

// Calls work(range, thread) for all chunks of [0, count), which a team's threads take as they come.
template <class Work>
int runChunks(Region& region, int threads, std::size_t count, std::size_t chunk, Work&& work) {
  ChunkQueue queue(count, chunk);
  return runTeam(region, threads, [&](int thread, int) {
    for (Range range; queue.next(range);) work(range, thread);
  });
}

}  // namespace ode_parallel_sap
