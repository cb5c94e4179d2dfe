// Whether a team of threads pays on this machine as it is just now.
#ifndef ODE_PARALLEL_SAP_TEAM_CHOICE_H
#define ODE_PARALLEL_SAP_TEAM_CHOICE_H

#include <algorithm>
#include <cstddef>

namespace ode_parallel_sap {

// A team waits for its slowest thread. Where other programs hold the cores, a thread may not run
// for some milliseconds, and a frame that one thread would finish in two takes a hundred. So the
// first two frames are done alone, the second one for comparison; when frames with a team take
// longer than that for each geom, the next ones are done alone, and the team is tried again later,
// at longer and longer intervals while it does not pay.
class TeamChoice {
 public:
  // The threads for the next frame, of `wanted`.
  int threads(int wanted) const { return alone_for_ > 0 ? 1 : wanted; }

  // What a frame took, without the callback.
  void learn(int threads, std::size_t geoms, double ms) {
    const double cost = ms / static_cast<double>(std::max<std::size_t>(geoms, 1));
    if (threads <= 1) {
      alone_cost_ = cost;
      if (alone_for_ > 0) --alone_for_;
      return;
    }
    if (cost <= alone_cost_) {
      bad_frames_ = 0;
      interval_ = shortest_interval;
    } else if (++bad_frames_ == most_bad_frames) {
      bad_frames_ = 0;
      alone_for_ = interval_;
      interval_ = std::min(2 * interval_, longest_interval);
    }
  }

 private:
  static constexpr int most_bad_frames = 3;
  static constexpr int shortest_interval = 16, longest_interval = 1024;  // frames

  double alone_cost_ = 0;  // ms a geom
  int alone_for_ = 2;      // frames still to be done alone
  int bad_frames_ = 0;     // in a row
  int interval_ = shortest_interval;
};

}  // namespace ode_parallel_sap

#endif
