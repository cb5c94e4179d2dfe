// ODE's data for the threads of a team.
#pragma once

#include <ode/ode.h>

#include "space/base/parallel.h"

namespace ode_parallel_sap {

// runParts() by threads that have ODE's data, the calling thread apart: that one's is its own
// business. Without manual cleanup ODE frees it when the thread ends or ODE is closed. Where there
// is no memory for it the others do a thread's work.
template <class Work>
int runPartsWithData(Region& region, int threads, std::size_t count, std::size_t chunk,
                     bool manual_cleanup, Work&& work) {
  PartQueue queue(count, chunk, threads);
  return runTeam(region, threads, [&](int thread, int) {
    struct Cleanup {
      const bool due;
      ~Cleanup() {
        if (due) dCleanupODEAllDataForThread();
      }
    } const cleanup = {thread != 0 && manual_cleanup};
    if (thread != 0 && !dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll))) return;
    for (Range range; queue.next(range, thread);) work(range, thread);
  });
}

}  // namespace ode_parallel_sap
