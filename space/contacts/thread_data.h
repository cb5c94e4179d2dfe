// ODE's data for the threads of a team.
#pragma once

#include <ode/ode.h>

#include "space/data/parallel.h"

namespace ode_parallel_sap {

// ODE's data for a thread of the team, the calling thread apart: that one's is its own business.
// Without manual cleanup ODE frees it when the thread ends or ODE is closed.
class ThreadData {
 public:
  ThreadData(int thread, bool manual_cleanup) : release_(thread != 0 && manual_cleanup) {
    ready_ = thread == 0 || dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
  }
  ~ThreadData() {
    if (release_) dCleanupODEAllDataForThread();
  }
  ThreadData(const ThreadData&) = delete;
  ThreadData& operator=(const ThreadData&) = delete;

  // Where there is no memory for it the others do this thread's work.
  bool ready() const { return ready_; }

 private:
  const bool release_;
  bool ready_;
};

// Calls work(range, thread) by threads that have such data for all ranges that next(range, thread)
// gives them.
template <class Next, class Work>
int runWithData(Region& region, int threads, bool manual_cleanup, Next next, Work& work) {
  return runTeam(region, threads, [&](int thread, int) {
    const ThreadData data(thread, manual_cleanup);
    for (Range range; data.ready() && next(range, thread);) work(range, thread);
  });
}

// runChunks() by such threads.
template <class Work>
int runChunksWithData(Region& region, int threads, std::size_t count, std::size_t chunk,
                      bool manual_cleanup, Work&& work) {
  ChunkQueue queue(count, chunk);
  return runWithData(
      region, threads, manual_cleanup, [&](Range& range, int) { return queue.next(range); }, work);
}

// runParts() by such threads.
template <class Work>
int runPartsWithData(Region& region, int threads, std::size_t count, std::size_t chunk,
                     bool manual_cleanup, Work&& work) {
  PartQueue queue(count, chunk, threads);
  return runWithData(
      region, threads, manual_cleanup,
      [&](Range& range, int thread) { return queue.next(range, thread); }, work);
}

}  // namespace ode_parallel_sap
