// ODE's data for the threads of a team.
#pragma once

#include <ode/ode.h>

#include "space/base/parallel.h"

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

// runParts() by threads that have such data.
template <class Work>
int runPartsWithData(Region& region, int threads, std::size_t count, std::size_t chunk,
                     bool manual_cleanup, Work&& work) {
  ChunkQueue queue(count, chunk, threads);
  return runTeam(region, threads, [&](int thread, int) {
    const ThreadData data(thread, manual_cleanup);
    for (Range range; data.ready() && queue.next(range, thread);) work(range, thread);
  });
}

}  // namespace ode_parallel_sap
