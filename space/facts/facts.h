// What the broad phase knows of a program's geoms and pairs, for ODE_PARALLEL_SAP_STATS=1.
#pragma once

#include <ode/ode.h>

#include <array>
#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "space/geoms/space_observer.h"
#include "space/ode/ode_space.h"

namespace ode_parallel_sap {

// A geom as it was when it was last seen.
struct LastGeom {
  using Box = std::array<dReal, 6>;
  unsigned long long moving_frame;  // then
  dVector3 place;
  Box box;
  Box motion;     // of the box's sides, since the frame before
  double coarse;  // a step of dReal at its place, in the geom's smallest sides
};

// Counts the pairs of one frame in `interval`, and sees all geoms after each frame before which any
// moved. Nothing but the lines depends on it.
class Facts : public SpaceObserver {
 public:
  bool isDue() override { return counts_[frames] % interval == 0; }
  void see(dGeomID a, dGeomID b) override;
  void endFrame(dxSpace* space, bool any_moved) override;
  // Its address may be another one's soon.
  void forget(const dxGeom* geom) override { last_.erase(geom); }
  // `frame`: of all on average.
  std::vector<std::string> lines(const FrameSums& frame) const;

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
  void seeMotion(const dxGeom* geom, const LastGeom& before, dReal step, double side,
                 LastGeom& now);
  void note(Kind kind, const dxGeom* geom, double measure);

  std::unordered_map<const dxGeom*, LastGeom> last_;
  unsigned long long moving_frame_ = 1;  // of those before which any moved
  bool all_stood_ = false;               // before the last frame
  std::array<Fact, kinds> facts_;
  // Frames; geoms of the space itself, and those without a body and still; pairs, and those that an
  // option leaves out, or that have a body at rest that is kept awake.
  enum Count { frames, geoms, statics, pairs, of_statics, of_sleepers, clear, kept_awake, counts };
  std::array<unsigned long long, counts> counts_ = {};
};

// Those of a space, which are printed after the sums of its frames when it or the process ends.
class PrintedFacts final : public Facts {
 public:
  explicit PrintedFacts(const ParallelSAPSpace& space);
  ~PrintedFacts() override;

 private:
  using Print = void (*)(const void* space, const char* text);
  void print(Print say) const;
  static void printAtExit();

  const void* const space_;
  const Statistics& statistics_;
};

}  // namespace ode_parallel_sap
