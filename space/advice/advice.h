// What options would leave out of a program's pairs: a line that ODE_PARALLEL_SAP_STATS=1 prints.
#pragma once

#include <ode/ode.h>

#include <string>

#include "space/geoms/space_observer.h"

namespace ode_parallel_sap {

// Counts all pairs of one frame in `interval`. Nothing but the line depends on it.
class Advice final : public SpaceObserver {
 public:
  // Of a space, for which it prints the line in the end; or for an account of several.
  explicit Advice(const void* space = nullptr) : space_(space) {}
  bool isDue() override;
  void see(dGeomID a, dGeomID b) override;
  void end(double pairs_ms, double frame_ms) override;

  // Adds what another space's has seen.
  void add(const Advice& other);
  // A line that names the options that would have left out a part of the pairs worth mentioning, if
  // there are any, with their share of the time by pair, which programs that ignore these pairs at
  // once do not save.
  std::string line(double pairs_ms, double frame_ms) const;

 private:
  static constexpr unsigned interval = 64;  // fixed: a pass over the pairs then costs 1 % at most

  double shareOf(unsigned long long pairs) const {
    return all_ ? static_cast<double>(pairs) / static_cast<double>(all_) : 0;
  }

  const void* const space_;
  unsigned frames_ = 0;
  unsigned long long all_ = 0, static_ = 0, asleep_ = 0, clear_ = 0;  // clear of a plane
};

}  // namespace ode_parallel_sap
