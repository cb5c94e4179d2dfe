// Leaves out for a while what turned out not to pay, longer each time.
#ifndef ODE_PARALLEL_SAP_BACK_OFF_H
#define ODE_PARALLEL_SAP_BACK_OFF_H

#include <algorithm>

namespace ode_parallel_sap {

// Counts in turns: frames in which the thing could have been done.
class BackOff {
 public:
  // Waits `first` turns after the first failure, `factor` times as many after each further one, at
  // most `longest`; and `now` turns to begin with.
  constexpr BackOff(int first, int factor, int longest, int now = 0)
      : first_(first), factor_(factor), longest_(longest), next_(first), left_(now) {}

  // Whether it is left out in the turn that comes.
  bool waits() const { return left_ > 0; }
  // A turn went by without it.
  void pass() { left_ -= left_ > 0; }
  void failed() {
    left_ = next_;
    next_ = std::min(next_ * factor_, longest_);
  }
  void paid() { next_ = first_; }

 private:
  int first_, factor_, longest_;
  int next_, left_;
};

}  // namespace ode_parallel_sap

#endif
