// Whether a team of threads pays on this machine as it is just now.
#pragma once

#include <algorithm>
#include <cstddef>

#include "space/base/back_off.h"
#include "space/base/mechanisms.h"

namespace ode_parallel_sap {

// A team waits for its slowest thread. Where other programs hold the cores, a thread may not run
// for some milliseconds, and a frame that one thread would finish in two takes a hundred. So the
// first two frames are done alone, the second one for comparison. When frames with a team take
// longer than that for each geom, or a team stalls, the next ones are done alone. The team is tried
// again later, at longer and longer intervals while it does not pay.
class TeamChoice {
 public:
  // The threads for the next frame, of `wanted`.
  int threads(int wanted) const {
    return mechanisms::learned_teams && back_off_.waits() ? 1 : wanted;
  }

  // What a frame took, without the callback. `stalled`: its team did.
  void learn(int threads, std::size_t geoms, double ms, bool stalled) {
    const double cost = ms / static_cast<double>(std::max<std::size_t>(geoms, 1));
    if (stalled) {
      leaveOut();
    } else if (threads <= 1) {
      alone_cost_ = cost;
      back_off_.pass();
    } else if (cost <= alone_cost_) {
      bad_frames_ = 0;
      back_off_.paid();
    } else if (++bad_frames_ == most_bad_frames) {
      leaveOut();
    }
  }
  // The same of a frame whose time says nothing about others.
  void learnOfOther(bool stalled) {
    if (stalled)
      leaveOut();
    else if (left_out_)
      back_off_.pass();
  }

 private:
  void leaveOut() {
    bad_frames_ = 0;
    left_out_ = true;
    back_off_.failed();
  }

  static constexpr int most_bad_frames = 3;  // fixed: so many in a row are no accident

  BackOff back_off_{retry_frames, 2};
  double alone_cost_ = 0;  // ms a geom
  int bad_frames_ = 0;     // in a row
  bool left_out_ = false;  // ever
};

}  // namespace ode_parallel_sap
