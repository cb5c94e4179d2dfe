// The statistics of a space, of its last frame and summed. No decision reads them.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "space/frame/stage_clock.h"

namespace ode_parallel_sap {

// The counts of a small frame, which has no other statistics but times; so small themselves that
// they fit registers.
struct FrameCounts {
  unsigned geoms = 0, moved = 0, disabled = 0, invalid = 0, unbounded = 0, candidates = 0,
           pairs = 0;
};

inline void setCounts(const FrameCounts& counts, dParallelSAPStats& stats) {
  stats.geoms = counts.geoms;
  stats.moved = counts.moved;
  stats.disabled = counts.disabled;
  stats.invalid = counts.invalid;
  stats.unbounded = counts.unbounded;
  stats.candidates = counts.candidates;
  stats.pairs = counts.pairs;
}

inline dParallelSAPStats statsOf(const FrameCounts& counts) {
  dParallelSAPStats stats = {};
  setCounts(counts, stats);
  stats.backend = dParallelSAPBackendCPU;
  stats.method = dParallelSAPMethodBruteForce;
  stats.threads = stats.find_threads = 1;
  return stats;
}

// Sums over frames, queries and rays, and over spaces.
struct FrameSums {
  unsigned long long frames = 0;
  double geoms = 0, pairs = 0, contacts = 0;
  double update_ms = 0, synchronise_ms = 0, extract_ms = 0, filter_ms = 0, narrow_ms = 0,
         report_ms = 0, total_ms = 0;
  // Frames have no part in these.
  unsigned long long queries = 0, rays = 0, probes = 0;
  double queries_ms = 0, rays_ms = 0, probes_ms = 0;
  unsigned long long ray_queries = 0, geom_queries = 0;  // that batches could be

  // A frame's statistics, or sums, divided by a number.
  template <class From>
  void addFrames(const From& from, double divisor = 1) {
    geoms += static_cast<double>(from.geoms) / divisor;
    pairs += static_cast<double>(from.pairs) / divisor;
    contacts += static_cast<double>(from.contacts) / divisor;
    update_ms += from.update_ms / divisor;
    synchronise_ms += from.synchronise_ms / divisor;
    extract_ms += from.extract_ms / divisor;
    filter_ms += from.filter_ms / divisor;
    narrow_ms += from.narrow_ms / divisor;
    report_ms += from.report_ms / divisor;
    total_ms += from.total_ms / divisor;
  }
  void add(const FrameSums& other) {
    addFrames(other);
    frames += other.frames;
    queries += other.queries;
    ray_queries += other.ray_queries;
    geom_queries += other.geom_queries;
    rays += other.rays;
    probes += other.probes;
    queries_ms += other.queries_ms;
    rays_ms += other.rays_ms;
    probes_ms += other.probes_ms;
  }
  // Calls print(queries, by, call) for a call that would do what a program asks one by one.
  template <class Print>
  void adviseBatches(Print print) const {
    constexpr unsigned long long many = 64;  // fixed: a frame; smaller batches start no thread
    const unsigned long long most = many * std::max(frames, 1ull);
    if (ray_queries > most) print(ray_queries, "rays", "dParallelSAPSpaceRays");
    if (geom_queries > most) print(geom_queries, "geoms", "dParallelSAPSpaceOverlaps");
  }
  // What grows with the pairs.
  double pairs_ms() const { return extract_ms + filter_ms + narrow_ms + report_ms; }
  // Of a frame.
  FrameSums average() const {
    FrameSums average;
    if (frames) average.addFrames(*this, static_cast<double>(frames));
    return average;
  }
};

class Statistics {
 public:
  // `sums`: they are printed in the end, so every frame is timed and added up.
  explicit Statistics(bool sums) : sums_wanted_(sums), times_wanted_(sums) {}

  void beginFrame() { ++last_.frames; }
  // What a frame has done so far: before the report, which may throw or collide again, and after.
  void note(const dParallelSAPStats& frame, const StageClock& clock) {
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
  // The same of a small frame. Few words are written: more would be a good part of a frame of two
  // geoms.
  void noteSmall(const FrameCounts& counts) {
    if (!std::exchange(last_was_small_, true)) {
      const unsigned long long frames = last_.frames;
      last_ = statsOf({});
      last_.frames = frames;
    }
    setCounts(counts, last_);
  }
  void noteSmallTimes(double found_ms, double report_ms) {
    last_.extract_ms = found_ms;
    last_.report_ms = report_ms;
    last_.total_ms = found_ms + report_ms;
  }
  // The last noted frame came to its end.
  void endFrame() {
    if (!sums_wanted_) return;
    ++sums_.frames;
    sums_.addFrames(last_);
  }

  // dSpaceCollide2 of one geom, with its callbacks, and a batch of rays or probes: summed only. Any
  // thread may note these.
  bool timesQueries() const { return sums_wanted_; }
  enum QueryBy { ray, geom, other };  // other: no batch does it
  void noteQuery(QueryBy by, double ms) {
    const std::lock_guard<std::mutex> lock(queries_mutex_);
    ++sums_.queries;
    sums_.ray_queries += by == ray;
    sums_.geom_queries += by == geom;
    sums_.queries_ms += ms;
  }
  void noteRays(std::size_t count, double ms) {
    const std::lock_guard<std::mutex> lock(queries_mutex_);
    sums_.rays += count;
    sums_.rays_ms += ms;
  }
  void noteOverlaps(std::size_t probes, double ms) {
    const std::lock_guard<std::mutex> lock(queries_mutex_);
    sums_.probes += probes;
    sums_.probes_ms += ms;
  }

  // Counts a small frame. True: this one is timed; reading the clock takes longer than colliding a
  // few geoms.
  bool beginSmallFrame() {
    return sums_wanted_ || (times_wanted_ && small_frames_++ % timed_interval == 0);
  }

  unsigned long long frames() const { return last_.frames; }
  const FrameSums& sums() const { return sums_; }
  // The program reads those of the last frame: small frames are timed from now on.
  const dParallelSAPStats& onRequest(std::size_t memory_bytes) {
    times_wanted_ = true;
    if (last_.frames) last_.memory_bytes = memory_bytes;
    return last_;
  }

 private:
  static constexpr unsigned timed_interval = 16;  // fixed: frames, as the header says

  bool sums_wanted_, times_wanted_;
  bool last_was_small_ = false;
  unsigned small_frames_ = 0;  // since times are wanted
  dParallelSAPStats last_ = {};
  FrameSums sums_;
  std::mutex queries_mutex_;
};

}  // namespace ode_parallel_sap
