// The statistics of a space: derived from what frames did, and summed, here and nowhere else. No
// decision reads them.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include "space/frame/frame_result.h"
#include "space/frame/frame_sums.h"

namespace ode_parallel_sap {

// Of a small scene.
inline FrameResult resultOf(const FrameCounts& small) {
  FrameResult result;
  static_cast<FrameCounts&>(result) = small;
  result.found.method = dParallelSAPMethodBruteForce;
  return result;
}

class Statistics {
 public:
  // `sums`: they are to be printed one day, so every frame is timed and added up.
  explicit Statistics(bool sums) : sums_wanted_(sums), times_wanted_(sums) {}

  void beginFrame() { ++last_.frames; }
  // Counts a frame that would do what the last one did, which was nothing. False: this one is to
  // run, to be timed.
  bool repeatFrame() {
    if (sums_wanted_ || ++repeated_frames_ % timed_interval == 0) return false;
    ++last_.frames;
    return true;
  }
  // What a frame has done so far: before the report, which may throw or collide again, and after.
  void note(const FrameResult& result);
  // The same of a small scene. Few words are written: more would be a good part of a frame of two
  // geoms.
  void noteSmall(const FrameCounts& counts) {
    if (!last_was_small_) beginSmall();
    noteCounts(counts);
  }
  // The times of a small frame.
  void noteTimes(double found_ms, double report_ms);
  // The last noted frame came to its end.
  void endFrame() {
    if (sums_wanted_) sums_.add(last_);
  }

  // dSpaceCollide2 of one geom, with its callbacks, and a batch of rays: summed only.
  bool timesQueries() const { return sums_wanted_; }
  void noteQuery(double ms) { sums_.addQueries(1, ms); }
  void noteRays(std::size_t count, double ms) { sums_.addRays(count, ms); }

  // Counts a small frame. True: this one is timed; reading the clock takes longer than colliding a
  // few geoms.
  bool beginSmallFrame() {
    return sums_wanted_ || (times_wanted_ && small_frames_++ % timed_interval == 0);
  }

  unsigned long long frames() const { return last_.frames; }
  const FrameSums& sums() const { return sums_; }
  // A program asked for those of the last frame: small frames are timed from now on.
  const dParallelSAPStats& onRequest(std::size_t memory_bytes) {
    times_wanted_ = true;
    if (last_.frames) last_.memory_bytes = memory_bytes;
    return last_;
  }

 private:
  static constexpr unsigned timed_interval = 16;  // fixed: frames, as the header says

  void clear();
  void noteCounts(const FrameCounts& counts) {
    last_.geoms = counts.geoms;
    last_.moved = counts.moved;
    last_.disabled = counts.disabled;
    last_.invalid = counts.invalid;
    last_.unbounded = counts.unbounded;
    last_.candidates = counts.candidates;
    last_.pairs = counts.pairs;
  }
  void beginSmall();

  bool sums_wanted_, times_wanted_;
  bool last_was_small_ = false;
  unsigned small_frames_ = 0;  // since times are wanted
  unsigned repeated_frames_ = 0;
  dParallelSAPStats last_ = {};
  FrameSums sums_;
};

}  // namespace ode_parallel_sap
