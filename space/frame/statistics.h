// What a space says to the program: messages through dMessage, each of them once, and statistics of
// its last frame and summed. No decision reads these.
#pragma once

#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

class Complaints {
 public:
  // Said again where there is no memory to note that it was said. Queries say it on any thread.
  void ofInvalid(const dxGeom* geom) {
    static std::mutex mutex;
    bool first = true;
    try {
      const std::lock_guard<std::mutex> lock(mutex);
      first = !made(invalid_) || invalid_->insert(geom).second;
    } catch (const std::bad_alloc&) {
    }
    if (first)
      dMessage(0, "parallel SAP space: geom %p has a NaN in its AABB and is left out of all pairs",
               static_cast<const void*>(geom));
  }
  // The geom is gone: another one may come to its address.
  void forget(const dxGeom* geom) {
    if (invalid_) invalid_->erase(geom);
  }
  void ofThreads(const void* space) {
    if (!two_threads_.exchange(true))
      dMessage(0,
               "parallel SAP space %p: a thread uses it while another one does, or has left a "
               "callback of it by longjmp",
               space);
  }
  void ofUnannounced(const dxGeom* geom, std::size_t count) {
    if (!std::exchange(unannounced_, true))
      dMessage(0,
               "parallel SAP space: %zu geoms changed, geom %p first, without the call of "
               "dParallelSAPSpaceNotify that dParallelSAPSpaceSetNotified promises",
               count, static_cast<const void*>(geom));
  }
  void ofTooLong(const ListsTooLong& lists) {
    if (!std::exchange(too_long_, true))
      dMessage(0,
               "parallel SAP space: the method AxisLists would need %.1f MB for the pairs of each "
               "axis and may take %.1f MB; the method Sweep is used where it does not fit",
               static_cast<double>(lists.needed) / 1e6, static_cast<double>(lists.allowed) / 1e6);
  }
  void ofNoMemory() {
    if (!std::exchange(no_memory_, true))
      dMessage(0, "parallel SAP space: out of memory, pairs are found for some geoms at a time");
  }
  void ofUnreportedEvents() {
    if (!std::exchange(unreported_events_, true))
      dMessage(0,
               "parallel SAP space: out of memory, a later frame reports the pairs that began "
               "and ended");
  }
  // On any thread.
  void ofEventsOff(const char* function, const char* kind) {
    if (!events_off_.exchange(true))
      dMessage(0,
               "parallel SAP space: %s() finds nothing, as dParallelSAPSpaceSetEvents has not "
               "switched %s on",
               function, kind);
  }
  void ofNoContacts(const char* function) {
    if (!no_contacts_.exchange(true))
      dMessage(0,
               "parallel SAP space: %s() finds nothing, as the last collide was not "
               "dParallelSAPSpaceCollideContacts and changed no touch",
               function);
  }

 private:
  std::unique_ptr<std::unordered_set<const dxGeom*>> invalid_;
  std::atomic<bool> two_threads_{false}, events_off_{false}, no_contacts_{false};
  bool too_long_ = false, no_memory_ = false, unreported_events_ = false, unannounced_ = false;
};

using Clock = std::chrono::steady_clock;

inline double milliseconds(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

// The counts of a small frame, which has no other statistics but times. They fit registers.
struct FrameCounts {
  unsigned geoms = 0, moved = 0, disabled = 0, invalid = 0, unbounded = 0, candidates = 0,
           pairs = 0;
};

inline dParallelSAPStats statsOf(const FrameCounts& counts) {
  dParallelSAPStats stats = {};
  stats.geoms = counts.geoms;
  stats.moved = counts.moved;
  stats.disabled = counts.disabled;
  stats.invalid = counts.invalid;
  stats.unbounded = counts.unbounded;
  stats.candidates = counts.candidates;
  stats.pairs = counts.pairs;
  stats.backend = dParallelSAPBackendCPU;
  stats.method = dParallelSAPMethodBruteForce;
  stats.threads = stats.find_threads = 1;
  return stats;
}

inline FrameCounts countsOf(const dParallelSAPStats& stats) {
  const auto to = [](std::size_t count) { return static_cast<unsigned>(count); };
  return {to(stats.geoms),     to(stats.moved),      to(stats.disabled), to(stats.invalid),
          to(stats.unbounded), to(stats.candidates), to(stats.pairs)};
}

// Sums over frames, queries and rays, and over spaces.
struct FrameSums {
  unsigned long long frames = 0;
  double geoms = 0, pairs = 0, contacts = 0;
  double update_ms = 0, extract_ms = 0, filter_ms = 0, narrow_ms = 0, report_ms = 0, total_ms = 0;
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
  // Of a frame.
  FrameSums average() const {
    FrameSums average;
    if (frames) average.addFrames(*this, static_cast<double>(frames));
    return average;
  }
  // What is printed of them.
  std::vector<std::string> lines() const {
    std::vector<std::string> all;
    const auto add = [&all](const char* format, auto... values) {
      char text[512];
      std::snprintf(text, sizeof text, format, values...);
      all.emplace_back(text);
    };
    const FrameSums frame = average();
    if (frames)
      add("%llu frames (%s), a frame: %.0f geoms, %.0f pairs, %.0f contacts, %.3f ms (update %.3f, "
          "extract %.3f, filter %.3f, narrow %.3f, report %.3f)",
          frames, kernelSet().name, frame.geoms, frame.pairs, frame.contacts, frame.total_ms,
          frame.update_ms, frame.extract_ms, frame.filter_ms, frame.narrow_ms, frame.report_ms);
    if (queries || rays || probes)
      add("dSpaceCollide2 of %llu geoms with their callbacks took %.3f ms, %llu rays took %.3f ms, "
          "%llu probes took %.3f ms",
          queries, queries_ms, rays, rays_ms, probes, probes_ms);
    // A call that would do what a program asks one by one.
    const auto advise = [&](unsigned long long count, const char* by, const char* call) {
      constexpr unsigned long long many = 64;  // fixed: a frame; smaller batches start no thread
      if (count > many * std::max(frames, 1ull))
        add("%s would answer %llu dSpaceCollide2 of %s on all threads", call, count, by);
    };
    advise(ray_queries, "rays", "dParallelSAPSpaceRays");
    advise(geom_queries, "geoms", "dParallelSAPSpaceOverlaps");
    return all;
  }
};

class Statistics {
 public:
  // `sums`: they are printed in the end, so every frame is timed and added up.
  explicit Statistics(bool sums) : sums_(sums ? new Sums : nullptr) {}

  void beginFrame() { ++frames_; }
  // What a frame has done so far: before the report, which may throw or collide again, and after.
  // Without memory no more than what is noted of a small one.
  void note(const dParallelSAPStats& frame) {
    small_ = {};
    last_was_small_ = !made(last_);
    if (last_was_small_) return void(small_.counts = countsOf(frame));
    *last_ = frame;
    last_->threads = std::max({frame.threads, frame.find_threads, frame.narrow_threads});
  }
  // The same of a small frame, in few words: more would be a good part of a frame of two geoms.
  void noteSmall(const FrameCounts& counts) {
    last_was_small_ = true;
    small_.counts = counts;
  }
  void noteSmallTimes(double found_ms, double report_ms) {
    small_.found_ms = found_ms;
    small_.report_ms = report_ms;
  }
  // The last noted frame came to its end. Returns its number of pairs.
  std::size_t endFrame(std::size_t pairs) {
    if (sums_) {
      ++sums_->of.frames;
      sums_->of.addFrames(last());
    }
    return pairs;
  }

  // Summed only, on any thread: dSpaceCollide2 with its callbacks, batches of rays or probes.
  bool timesQueries() const { return sums_ != nullptr; }
  enum QueryBy { ray, geom, other };  // other: no batch does it
  void noteQuery(QueryBy by, double ms) {
    addQueries([=](FrameSums& sums) {
      ++sums.queries;
      sums.ray_queries += by == ray;
      sums.geom_queries += by == geom;
      sums.queries_ms += ms;
    });
  }
  void noteRays(std::size_t count, double ms) {
    addQueries([=](FrameSums& sums) { sums.rays += count, sums.rays_ms += ms; });
  }
  void noteOverlaps(std::size_t probes, double ms) {
    addQueries([=](FrameSums& sums) { sums.probes += probes, sums.probes_ms += ms; });
  }

  // Counts a small frame. True: it is timed. The clock takes longer than colliding a few geoms.
  bool beginSmallFrame() {
    return sums_ || (times_wanted_ && small_frames_++ % timed_interval == 0);
  }

  unsigned long long frames() const { return frames_; }
  FrameSums sums() const { return sums_ ? sums_->of : FrameSums(); }
  // The program reads those of the last frame: small frames are timed from now on.
  dParallelSAPStats onRequest(std::size_t memory_bytes) {
    times_wanted_ = true;
    dParallelSAPStats stats = last();
    if (frames_) stats.memory_bytes = memory_bytes;
    return stats;
  }

 private:
  static constexpr unsigned timed_interval = 16;  // fixed: frames, as the header says

  struct Sums {
    FrameSums of;
    std::mutex queries_mutex;
  };

  template <class Add>
  void addQueries(Add add) {
    if (!sums_) return;
    const std::lock_guard<std::mutex> lock(sums_->queries_mutex);
    add(sums_->of);
  }

  dParallelSAPStats last() const {
    dParallelSAPStats stats = {};
    if (frames_) stats = last_was_small_ ? statsOf(small_.counts) : *last_;
    if (last_was_small_) {
      stats.extract_ms = small_.found_ms;
      stats.report_ms = small_.report_ms;
      stats.total_ms = small_.found_ms + small_.report_ms;
    }
    stats.frames = frames_;
    return stats;
  }

  bool times_wanted_ = false;
  bool last_was_small_ = true;
  unsigned small_frames_ = 0;  // since times are wanted
  unsigned long long frames_ = 0;
  struct {
    FrameCounts counts;
    double found_ms = 0, report_ms = 0;
  } small_;
  std::unique_ptr<dParallelSAPStats> last_;  // if that was no small one
  std::unique_ptr<Sums> sums_;
};

}  // namespace ode_parallel_sap
