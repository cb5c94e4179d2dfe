// All that is decided about a frame, and what was learnt from those before it.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <omp.h>
#include <algorithm>
#include <cstddef>

#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/finders/extraction.h"
#include "space/frame/device_choice.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

// What a user may set on a space.
struct Settings {
  int backend = dParallelSAPBackendAuto;
  int method = dParallelSAPMethodAuto;
  int threads = 0;  // 0: what OpenMP would use
  int devices = 0;  // 0: chosen by the space
  bool print_stats = false;
  PairRules rules;
};

// The threads a collide may use: 1 to most_threads.
inline int threadsFor(const Settings& settings) {
  if (teamsAreLost()) return 1;
  return std::max(
      1, std::min(settings.threads ? settings.threads : omp_get_max_threads(), most_threads));
}

// What is known when a frame begins.
struct SceneFacts {
  std::size_t slots;
  std::size_t last_pairs;  // of the last frame's boxes
  bool last_wide;          // they were doubles
  bool nested;             // within a callback of this space
  DeviceBackend::Devices devices;
};

// What a frame is to do: decided once, when it begins.
struct Plan {
  PairRules rules;         // those that the user set
  int threads = 1;         // of all stages up to the report
  int most_threads = 1;    // of the narrow phase, or of a report in blocks on all threads
  bool fat_pairs = false;  // kept pairs of larger boxes may do, if those hold the boxes
  bool use_cache = false;  // boxes and pairs of the last frame do where little has changed
  ExtractionPlan extraction;
  // Where extraction may run on devices: what was weighed, and how it came out.
  bool weighs_devices = false;
  DeviceChoice::Decision device_decision;
};

// Pairs and their order depend on none of its decisions, which may depend on what frames took.
class Policy {
 public:
  Plan decide(const SceneFacts& facts, const Settings& settings) const;
  // The threads that are worth their start for anything that goes through so many slots.
  static int teamFor(std::size_t slots, const Settings& settings);

  // A frame weighed devices by `plan`, and `found` its pairs anew; null: it kept them. Returns how
  // many devices should be made ready.
  int learn(const Plan& plan, const SceneFacts& facts, const Settings& settings,
            const dParallelSAPStats* found);

 private:
  void planDevices(const SceneFacts& facts, const Settings& settings, Plan& plan) const;

  DeviceChoice device_choice_;
};

// Storage is given back once many frames in a row have needed less than a quarter of it. Giving
// back all at once takes longer than a small frame, so each of the next frames gives back a part.
class MemoryWatch {
 public:
  static constexpr int none = -1;  // fixed: no part
  static constexpr int parts = 5;  // fixed: those of Pipeline::release(), and what the space has

  // A frame had so many geoms and pairs. The part of what is kept that is better given back, and
  // grown again by the next frame to the size of the last ones.
  int noteFrame(std::size_t geoms, std::size_t pairs) {
    // A geom takes about ten times the storage of a pair.
    const std::size_t need = 10 * geoms + pairs;
    if (need >= largest_ / 4) {
      largest_ = std::max(largest_, need);
      recent_ = 0;
      frames_ = 0;
      return none;
    }
    recent_ = std::max(recent_, need);
    if (largest_ < least_need || ++frames_ < idle_frames) return none;
    const int part = frames_ - idle_frames;
    if (part + 1 == parts) {
      largest_ = recent_;
      recent_ = 0;
      frames_ = 0;
    }
    return part;
  }

 private:
  static constexpr std::size_t least_need = 20000;  // fixed: some hundred KB are not worth it

  std::size_t largest_ = 0;  // of all frames since storage was given back
  std::size_t recent_ = 0;   // of the last frames_, all far below that
  int frames_ = 0;
};

}  // namespace ode_parallel_sap
