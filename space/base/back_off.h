// Leaves out for a while what turned out not to pay, longer each time.
#pragma once

#include <algorithm>

#include "space/base/tuning.h"

namespace ode_parallel_sap {

// Counts in turns: frames in which the thing could have been done.
class BackOff {
 public:
  // Waits `first` turns after the first failure, twice as many after each further one, at most
  // back_off_range times as many.
  constexpr explicit BackOff(int first) : first_(first), next_(first) {}

  // A turn comes. Returns whether the thing is left out in it.
  bool skipTurn() { return left_ > 0 && left_-- > 0; }
  void failed() {
    left_ = next_;
    next_ = std::min(2 * next_, back_off_range * first_);
  }
  void paid() { next_ = first_; }

 private:
  int first_, next_, left_ = 0;
};

}  // namespace ode_parallel_sap
