// Threads of the program's own.
#pragma once

#include <ode/ode.h>

#include <atomic>
#include <thread>
#include <vector>

namespace sap_test {

// Calls work(0) to work(threads - 1) at once, each on a thread of its own that may use ODE.
template <class Work>
void together(int threads, Work work) {
  std::atomic<int> ready{0};
  std::vector<std::thread> workers;
  for (int i = 0; i < threads; ++i)
    workers.emplace_back([&, i] {
      dAllocateODEDataForThread(dAllocateMaskAll);
      for (++ready; ready < threads;) std::this_thread::yield();
      work(i);
      dCleanupODEAllDataForThread();
    });
  for (std::thread& worker : workers) worker.join();
}

}  // namespace sap_test
