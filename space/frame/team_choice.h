// Whether a team of threads pays on this machine as it is just now.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "space/base/back_off.h"
#include "space/base/mechanisms.h"
#include "space/base/platform.h"
#include "space/base/team.h"

namespace ode_parallel_sap {

// A team waits for its slowest thread. Where other programs hold the cores, a thread may not run
// for some milliseconds, and a frame that one thread would finish in two takes a hundred. So the
// first two frames are done alone, the second one for comparison; when frames with a team take
// longer than that for each geom, or a team stalls, the next ones are done alone, and the team is
// tried again later, at longer and longer intervals while it does not pay. It is not tried while
// others take even the calling thread's core.
class TeamChoice {
 public:
  explicit TeamChoice(ThreadUse (*use)() = threadUse) : use_(use) {}

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
      pass(ms < least_ms_of_busy_teams);
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
      pass(true);
  }

 private:
  void pass(bool waits_where_busy) {
    back_off_.pass();
    if (!back_off_.waits() && isPreempted() && waits_where_busy) back_off_.again();
  }
  // A single time may be the system's doing.
  bool isPreempted() {
    if (teamsAreTested()) return false;
    const ThreadUse before = std::exchange(last_use_, use_());
    return static_cast<double>(last_use_.preempted - before.preempted) >
           1 + (last_use_.cpu_ms - before.cpu_ms) / slice_ms;
  }
  void leaveOut() {
    bad_frames_ = 0;
    left_out_ = true;
    back_off_.failed();
  }

  static constexpr int most_bad_frames = 3;  // fixed: so many in a row are no accident
  // fixed: threads that share a core are preempted more often, mostly every 3 or 4 ms.
  static constexpr double slice_ms = 16;
  // fixed: a frame that takes longer alone gains more by a team than a stall costs.
  static constexpr double least_ms_of_busy_teams = 16;

  BackOff back_off_{retry_frames, 2};
  double alone_cost_ = 0;  // ms a geom
  int bad_frames_ = 0;     // in a row
  bool left_out_ = false;  // ever
  ThreadUse (*const use_)();
  ThreadUse last_use_;  // when a back-off was over
};

}  // namespace ode_parallel_sap
