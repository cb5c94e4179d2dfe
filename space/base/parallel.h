// The one way work is given to threads here.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <type_traits>
#include <utility>

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
