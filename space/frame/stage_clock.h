// Times of stages, and their ranges for profilers.
#pragma once

#include <chrono>

#include "space/frame/stage_ranges.h"

namespace ode_parallel_sap {

using Clock = std::chrono::steady_clock;

inline double milliseconds(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

// Hands out the time since it was last asked.
class StageClock {
 public:
  // The stage that runs from now on, until the next one or the end of the clock.
  void begin(Stage stage) { range_.begin(stage); }
  double lap() {
    const Clock::time_point before = lap_;
    lap_ = Clock::now();
    return milliseconds(before, lap_);
  }
  // Up to the last lap.
  double total() const { return milliseconds(begin_, lap_); }

 private:
  Clock::time_point begin_ = Clock::now(), lap_ = begin_;
  StageRange range_;
};

}  // namespace ode_parallel_sap
