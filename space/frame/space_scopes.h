// What a call into the space holds until it is left, in whatever way.
#ifndef ODE_PARALLEL_SAP_SPACE_SCOPES_H
#define ODE_PARALLEL_SAP_SPACE_SCOPES_H

#include <chrono>
#include <utility>

#include "space/ode/ode_space.h"

namespace ode_parallel_sap {

using Clock = std::chrono::steady_clock;

inline double milliseconds(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

// Locks the space against changes to its contents.
class ParallelSAPSpace::Lock {
 public:
  explicit Lock(ParallelSAPSpace& space) : space_(space) { ++space_.lock_count; }
  ~Lock() { --space_.lock_count; }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  ParallelSAPSpace& space_;
};

// Hands out the time since it was last asked.
class ParallelSAPSpace::StageClock {
 public:
  StageClock() : begin_(Clock::now()), lap_(begin_) {}
  double lap() {
    const Clock::time_point before = lap_;
    lap_ = Clock::now();
    return milliseconds(before, lap_);
  }
  double total() const { return milliseconds(begin_, lap_); }

 private:
  const Clock::time_point begin_;
  Clock::time_point lap_;
};

// The list of pairs while the callback runs, out of reach of a collide within it, which finds the
// members free. Goes back when the scope is left in whatever way.
class ParallelSAPSpace::Frame {
 public:
  explicit Frame(ParallelSAPSpace& space)
      : pairs(std::move(space.pairs_)), space_(space), number_(space.stats_.frames) {}
  ~Frame() {
    space_.pairs_ = std::move(pairs);
    if (space_.stats_.frames != number_) space_.pair_keeper_.stop();
  }
  Frame(const Frame&) = delete;
  Frame& operator=(const Frame&) = delete;

  PairList pairs;

 private:
  ParallelSAPSpace& space_;
  const unsigned long long number_;
};

}  // namespace ode_parallel_sap

#endif
