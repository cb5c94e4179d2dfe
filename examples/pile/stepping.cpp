#include "stepping.h"

#include <algorithm>
#include <thread>

#include "options.h"

namespace pile {

ParallelStepping::ParallelStepping(dWorldID world, int threads)
    : world_(world), threading_(dThreadingAllocateMultiThreadedImplementation()), pool_(nullptr) {
  if (!threading_) throw UsageError("--stepping parallel needs an ODE with its built-in threading");
  const unsigned count = static_cast<unsigned>(steppingThreads(threads));
  pool_ = dThreadingAllocateThreadPool(count, 0, dAllocateFlagBasicData, nullptr);
  if (!pool_) {
    dThreadingFreeImplementation(threading_);
    throw std::runtime_error("ODE could not start its threads");
  }
  dThreadingThreadPoolServeMultiThreadedImplementation(pool_, threading_);
  dWorldSetStepThreadingImplementation(world_, dThreadingImplementationGetFunctions(threading_),
                                       threading_);
}

ParallelStepping::~ParallelStepping() {
  dThreadingImplementationShutdownProcessing(threading_);
  dThreadingFreeThreadPool(pool_);
  dWorldSetStepThreadingImplementation(world_, nullptr, nullptr);
  dThreadingFreeImplementation(threading_);
}

int steppingThreads(int threads) {
  return threads ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace pile
