// Leaves out for a while what turned out not to help, longer each time.
#ifndef ODE_PARALLEL_SAP_PAUSE_H
#define ODE_PARALLEL_SAP_PAUSE_H

#include <algorithm>

namespace ode_parallel_sap {

class Pause {
 public:
  // Whether it is left out this time. To be asked once a turn: the last one of a pause is a trial.
  bool skipsTurn() { return left_ > 0 && --left_ > 0; }
  void lengthen(int factor, int longest) {
    length_ = std::min(length_ * factor, longest);
    left_ = length_;
  }
  void reset() { length_ = 1; }

 private:
  int length_ = 1, left_ = 0;
};

}  // namespace ode_parallel_sap

#endif
