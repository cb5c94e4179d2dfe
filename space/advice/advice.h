// What options would leave out of a program's pairs, and where physics breaks: the lines that
// ODE_PARALLEL_SAP_STATS=1 prints.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "space/advice/physics.h"
#include "space/ode/space_observer.h"

namespace ode_parallel_sap {

// Counts all pairs of one frame in `interval`, and looks at bodies after it and the next one.
// Nothing but the lines depends on it.
class Advice final : public SpaceObserver {
 public:
  // Of a space, for which it prints the lines in the end; or for an account of several.
  explicit Advice(const void* space = nullptr) : space_(space) {}
  ~Advice() override;

  bool isDue() override;
  void see(dGeomID a, dGeomID b, int contacts) override;
  void endFrame(dxGeom* const* geoms, std::size_t slots, dReal swept) override;
  const Physics& physics() const { return physics_; }

  // Adds what another space's has seen.
  void add(const Advice& other);
  // A line that names the options that would have left out a part of the pairs worth mentioning, if
  // there are any, and those of Physics.
  std::vector<std::string> lines() const;

 private:
  static constexpr unsigned interval = 64;  // fixed: a pass over the pairs then costs 1 % at most

  // Pairs of two categories, the smaller number first, of which it is known whether they touch.
  struct Layers {
    unsigned long a = 0, b = 0;
    unsigned long long pairs = 0, touching = 0;
  };

  void count(const Layers& layers);
  double shareOf(unsigned long long pairs) const {
    return all_ ? static_cast<double>(pairs) / static_cast<double>(all_) : 0;
  }

  const void* const space_;
  unsigned frames_ = 0;
  unsigned place_ = interval;  // of the frame that runs among so many
  Physics physics_;
  unsigned long long all_ = 0, static_ = 0, asleep_ = 0, clear_ = 0;  // clear of a plane
  std::array<Layers, 16> layers_;  // what finds no room are few pairs, or no layers
  std::size_t used_layers_ = 0;
};

}  // namespace ode_parallel_sap
