// Times of the stages of a frame.
#pragma once

#include <chrono>

namespace ode_parallel_sap {

// As in the statistics.
enum class Stage { update, synchronise, extract, filter, events, narrow, report, none };

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
};

}  // namespace ode_parallel_sap
