// What the broad phase knows of a program's geoms and pairs, for ODE_PARALLEL_SAP_STATS=1.
#pragma once

#include <ode/ode.h>

#include <array>
#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "space/geoms/space_observer.h"

namespace ode_parallel_sap {

// The geoms of all spaces in one, as they were in its last frame, in the order in which that was
// gone through. It is mostly that of this frame: a stock space puts a geom that moves first.
class LastGeoms {
 public:
  using Box = std::array<dReal, 6>;
  struct Geom {
    const dxGeom* geom;
    Box box;
    Box motion;     // of the box's sides when it last moved
    double moved;   // then, in the geom's smallest sides
    double coarse;  // a step of dReal at its place, likewise
  };

  void begin() {
    last_.swap(now_);
    now_.clear();
    passed_.clear();
    next_ = 0;
  }
  // What a geom was; null if it is new.
  const Geom* find(const dxGeom* geom);
  void add(const Geom& geom) { now_.push_back(geom); }

 private:
  void pass(std::size_t end);

  std::vector<Geom> now_, last_;
  std::size_t next_ = 0;                                   // in last_
  std::unordered_map<const dxGeom*, std::size_t> passed_;  // what it went past
};

// Counts the pairs of one frame in `interval`, and sees all geoms after each frame before which any
// moved. Nothing but the lines depends on it.
class Facts final : public SpaceObserver {
 public:
  bool isDue() override { return frames_ % interval == 0; }
  void see(dGeomID a, dGeomID b) override;
  void endFrame(dxSpace* space, bool any_moved) override;
  std::vector<std::string> lines(const FrameTimes& frame) const override;

  // Adds what another space's has seen.
  void add(const Facts& other);

 private:
  static constexpr unsigned interval = 64;  // fixed: a pass over the pairs then costs 1 % at most

  enum Kind { fast, swept, far_away, invalid, kinds };
  struct Fact {
    std::size_t now = 0, most = 0;  // geoms in a frame
    unsigned long long frames = 0;
    double worst = 0;
    const void* geom = nullptr;
  };

  void seeSpace(dxSpace* space, bool counts);
  bool seeGeom(dxGeom* geom, Kind kind);
  void note(Kind kind, const dxGeom* geom, double measure);

  LastGeoms last_;
  std::array<Fact, kinds> facts_;
  unsigned long long frames_ = 0;
  unsigned long long geoms_ = 0, static_ = 0;  // of the space itself; without a body, and still
  // Pairs, of which some are clear of a plane, or have a body at rest that is kept awake.
  unsigned long long all_ = 0, static_pairs_ = 0, asleep_ = 0, clear_ = 0, kept_awake_ = 0;
};

}  // namespace ode_parallel_sap
