// Times of stages, and their ranges for profilers.
#pragma once

#include <chrono>

#include "space/frame/stage_ranges.h"

namespace ode_parallel_sap {

using Clock = std::chrono::steady_clock;

inline double milliseconds(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

// Adds up the time of each stage, from its begin() to the next one.
class StageClock {
 public:
  void begin(Stage stage) {
    const Clock::time_point now = Clock::now();
    ms_[static_cast<int>(stage_)] += milliseconds(last_, now);
    last_ = now;
    stage_ = stage;
    range_.begin(stage);
  }
  // No stage runs until the next begin().
  void pause() { begin(Stage::none); }
  double of(Stage stage) const { return ms_[static_cast<int>(stage)]; }
  // Up to the last begin().
  double total() const { return milliseconds(first_, last_); }

 private:
  const Clock::time_point first_ = Clock::now();
  Clock::time_point last_ = first_;
  Stage stage_ = Stage::none;
  double ms_[static_cast<int>(Stage::none) + 1] = {};
  StageRange range_;
};

}  // namespace ode_parallel_sap
