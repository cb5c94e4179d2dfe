// What the broad phase knows of a program's geoms and pairs, for ODE_PARALLEL_SAP_STATS=1.
#pragma once

#include <ode/ode.h>

#include <array>
#include <cstddef>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "space/geoms/space_observer.h"

namespace ode_parallel_sap {

// The geoms of all spaces in one, as they were in its last frame, in the order in which that was
// gone through. This frame's is like it: a stock space puts a geom that moves first.
class LastGeoms {
 public:
  using Box = std::array<dReal, 6>;
  struct Geom {
    const dxGeom* geom;
    dVector3 place;
    Box box;
    Box motion;                // of the box's sides when it last moved
    unsigned long long frame;  // then
    double moved;              // then, in the geom's smallest sides
    double coarse;             // a step of dReal at its place, likewise
  };

  void begin() {
    last_.swap(now_);
    now_.clear();
    places_.clear();
    next_ = 0;
  }
  void end() { gone_.clear(); }
  // Its address may be another geom's in the next frame.
  void forget(const dxGeom* geom) { gone_.insert(geom); }
  // What a geom was; null if it is new.
  const Geom* find(const dxGeom* geom);
  void add(const Geom& geom) { now_.push_back(geom); }

 private:
  std::vector<Geom> now_, last_;
  std::size_t next_ = 0;                                   // in last_
  std::unordered_map<const dxGeom*, std::size_t> places_;  // in last_, once the order differs
  std::unordered_set<const dxGeom*> gone_;
};

// Counts the pairs of one frame in `interval`, and sees all geoms after each frame before which any
// moved. Nothing but the lines depends on it.
class Facts final : public SpaceObserver {
 public:
  bool isDue() override { return counts_[frames] % interval == 0; }
  void see(dGeomID a, dGeomID b) override;
  void endFrame(dxSpace* space, bool any_moved) override;
  void forget(const dxGeom* geom) override;
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

  void seeSpace(dxSpace* space, bool of_space);
  bool seeGeom(dxGeom* geom, dReal step);
  void seeMotion(const LastGeoms::Geom& before, dReal step, double side, LastGeoms::Geom& now);
  void note(Kind kind, const dxGeom* geom, double measure);

  LastGeoms last_;
  std::array<Fact, kinds> facts_;
  // Frames; geoms of the space itself, and those without a body and still; pairs, and those that an
  // option leaves out, or that have a body at rest that is kept awake.
  enum Count { frames, geoms, statics, pairs, of_statics, of_sleepers, clear, kept_awake, counts };
  std::array<unsigned long long, counts> counts_ = {};
};

}  // namespace ode_parallel_sap
