#include "space/frame/statistics.h"

#include <algorithm>

namespace ode_parallel_sap {

void Statistics::note(const dParallelSAPStats& frame, const StageClock& clock) {
  const unsigned long long frames = last_.frames;
  last_was_small_ = false;
  last_ = frame;
  last_.frames = frames;
  last_.threads = std::max({frame.threads, frame.find_threads, frame.narrow_threads});
  last_.update_ms = clock.of(Stage::update);
  last_.synchronise_ms = clock.of(Stage::synchronise);
  last_.extract_ms = clock.of(Stage::extract);
  last_.filter_ms = clock.of(Stage::filter);
  last_.events_ms = clock.of(Stage::events);
  last_.narrow_ms = clock.of(Stage::narrow);
  last_.report_ms = clock.of(Stage::report);
  last_.total_ms = clock.total();
}

// The first small frame after another: what is the same of all.
void Statistics::beginSmall() {
  const unsigned long long frames = last_.frames;
  last_ = statsOf({});
  last_.frames = frames;
  last_was_small_ = true;
}

void Statistics::noteSmallTimes(double found_ms, double report_ms) {
  last_.extract_ms = found_ms;
  last_.report_ms = report_ms;
  last_.total_ms = found_ms + report_ms;
}

}  // namespace ode_parallel_sap
