// Whoever wants to see the pairs of some frames besides the program.
#pragma once

#include <ode/ode.h>

namespace ode_parallel_sap {

class PairWatcher {
 public:
  virtual ~PairWatcher() = default;
  // Whether it wants the pairs of the frame that runs, within no callback.
  virtual bool isDue() = 0;
  // One of these pairs. The space is locked.
  virtual void see(dGeomID a, dGeomID b) = 0;
  // These were all, of a frame without contacts.
  virtual void endPairs() {}
};

}  // namespace ode_parallel_sap
