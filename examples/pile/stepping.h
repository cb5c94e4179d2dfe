#ifndef PILE_STEPPING_H
#define PILE_STEPPING_H

#include <ode/ode.h>

namespace pile {

// ODE's own threads for dWorldQuickStep, as long as this lives.
class ParallelStepping {
 public:
  // Throws UsageError where this ODE was built without them.
  ParallelStepping(dWorldID world, int threads);
  ~ParallelStepping();
  ParallelStepping(const ParallelStepping&) = delete;
  ParallelStepping& operator=(const ParallelStepping&) = delete;

 private:
  dWorldID world_;
  dThreadingImplementationID threading_;
  dThreadingThreadPoolID pool_;
};

// `threads`, or if that is 0 as many as the program may use.
int steppingThreads(int threads);

}  // namespace pile

#endif
