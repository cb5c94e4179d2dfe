// Whoever wants to see the pairs of some frames besides the program.
#pragma once

#include <ode/ode.h>

namespace ode_parallel_sap {

class PairWatcher {
 public:
  static constexpr int unknown = -1;   // fixed: nobody collided the pair
  static constexpr int unwanted = -2;  // fixed: its flags said that nobody wants its contacts

  virtual ~PairWatcher() = default;
  // Whether it wants the pairs of the frame that runs, within no callback.
  virtual bool isDue() = 0;
  // One of these pairs, and the number of its contacts where that is known. The space is locked.
  virtual void see(dGeomID a, dGeomID b, int contacts) = 0;
  // These were all, of a frame whose pairs nobody collided.
  virtual void endPairs() {}
};

}  // namespace ode_parallel_sap
