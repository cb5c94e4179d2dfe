// The statistics of a space: derived from what frames did, and summed, here and nowhere else. No
// decision reads them.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include "space/frame/frame_result.h"
#include "space/frame/frame_sums.h"
#include "space/frame/pair_sample.h"

namespace ode_parallel_sap {

// What the smallest scenes tell: no stage but the report has a time of its own.
struct SmallResult {
  std::size_t geoms = 0, moved = 0, disabled = 0, invalid = 0, unbounded = 0, candidates = 0,
              pairs = 0;
};

inline FrameResult resultOf(const SmallResult& small) {
  FrameResult result;
  result.geoms = small.geoms;
  result.moved = small.moved;
  result.disabled = small.disabled;
  result.invalid = small.invalid;
  result.unbounded = small.unbounded;
  result.candidates = small.candidates;
  result.pairs = small.pairs;
  result.found.method = dParallelSAPMethodBruteForce;
  return result;
}

class Statistics {
 public:
  // `sums`: they are to be printed one day, so every frame is timed and added up.
  explicit Statistics(bool sums) : sums_wanted_(sums), times_wanted_(sums), sample_(sums) {}

  void beginFrame() { ++last_.frames; }
  // What a frame has done so far: before the report, which may throw or collide again, and after.
  void note(const FrameResult& result);
  // Few words are written: more would be a good part of a frame of two geoms.
  void note(const SmallResult& result) {
    if (!last_was_small_) beginSmall();
    last_.geoms = result.geoms;
    last_.moved = result.moved;
    last_.disabled = result.disabled;
    last_.invalid = result.invalid;
    last_.unbounded = result.unbounded;
    last_.candidates = result.candidates;
    last_.pairs = result.pairs;
  }
  // The times of a small frame.
  void noteTimes(double found_ms, double report_ms);
  // The last noted frame came to its end.
  void endFrame() {
    if (!sums_wanted_) return;
    sums_.add(last_);
    sample_.endFrame(last_.pairs, last_.total_ms);
  }

  // Whether the next small frame may be one that is timed.
  bool timesNextSmallFrame() const { return times_wanted_; }
  // Counts a small frame. True: this one is timed; reading the clock takes longer than colliding a
  // few geoms.
  bool beginSmallFrame() {
    constexpr unsigned interval = 16;  // fixed: frames, as the header says
    return sums_wanted_ || (times_wanted_ && small_frames_++ % interval == 0);
  }

  unsigned long long frames() const { return last_.frames; }
  const FrameSums& sums() const { return sums_; }
  // Picks nothing unless sums are wanted.
  PairSample& sample() { return sample_; }
  const SampledPairs& sampled() const { return sample_.seen(); }
  // A program asked for those of the last frame: small frames are timed from now on.
  const dParallelSAPStats& onRequest(std::size_t memory_bytes) {
    times_wanted_ = true;
    if (last_.frames) last_.memory_bytes = memory_bytes;
    noteSample();
    return last_;
  }

 private:
  void clear();
  void beginSmall();
  void noteSample();

  bool sums_wanted_, times_wanted_;
  bool last_was_small_ = false;
  unsigned small_frames_ = 0;  // since times are wanted
  dParallelSAPStats last_ = {};
  FrameSums sums_;
  PairSample sample_;
};

}  // namespace ode_parallel_sap
