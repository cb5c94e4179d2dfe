// Statistics summed over frames, queries and rays, and over spaces.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

namespace ode_parallel_sap {

class FrameSums {
 public:
  struct Sums {
    unsigned long long frames = 0;
    double geoms = 0, pairs = 0, contacts = 0;
    double update_ms = 0, synchronise_ms = 0, extract_ms = 0, filter_ms = 0, narrow_ms = 0,
           report_ms = 0, total_ms = 0;
    // Of all; frames have no part in them.
    unsigned long long queries = 0, rays = 0;
    double queries_ms = 0, rays_ms = 0;
  };

  void add(const dParallelSAPStats& frame) {
    ++sums_.frames;
    addAll(frame, 1, sums_);
  }
  void add(const FrameSums& other) {
    sums_.frames += other.sums_.frames;
    addAll(other.sums_, 1, sums_);
    addQueries(other.sums_.queries, other.sums_.queries_ms);
    addRays(other.sums_.rays, other.sums_.rays_ms);
  }
  void addQueries(unsigned long long count, double ms) {
    sums_.queries += count;
    sums_.queries_ms += ms;
  }
  void addRays(unsigned long long count, double ms) {
    sums_.rays += count;
    sums_.rays_ms += ms;
  }
  const Sums& sums() const { return sums_; }
  // Of a frame. `frames` is the number of all.
  Sums average() const {
    Sums average;
    average.frames = sums_.frames;
    if (sums_.frames) addAll(sums_, 1 / static_cast<double>(sums_.frames), average);
    return average;
  }

 private:
  template <class From>
  static void addAll(const From& from, double share, Sums& sums) {
    sums.geoms += static_cast<double>(from.geoms) * share;
    sums.pairs += static_cast<double>(from.pairs) * share;
    sums.contacts += static_cast<double>(from.contacts) * share;
    sums.update_ms += from.update_ms * share;
    sums.synchronise_ms += from.synchronise_ms * share;
    sums.extract_ms += from.extract_ms * share;
    sums.filter_ms += from.filter_ms * share;
    sums.narrow_ms += from.narrow_ms * share;
    sums.report_ms += from.report_ms * share;
    sums.total_ms += from.total_ms * share;
  }

  Sums sums_;
};

}  // namespace ode_parallel_sap
