// Boxes that cover the motion of the coming step.
#pragma once

#include <ode/ode.h>

#include <array>
#include <cstddef>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"

struct dxGeom;
struct dxSpace;

namespace ode_parallel_sap {

// Writes swept bounds into the geoms themselves, as their AABBs, before anything else of a frame or
// query reads these. A geom stays dirty, but its AABB counts as up to date. ODE announces no change
// of speed, so every geom is compared, and made dirty if it moves otherwise than when its AABB was
// made.
class SweptBounds {
 public:
  // How long a step is that boxes cover; 0: they are as geoms lie.
  void setStep(dReal step) { step_ = step; }
  dReal step() const { return step_; }
  bool idle() const { return step_ == 0 && records_.empty() && !all_stale_; }
  // Brings the AABBs of all geoms of `space` whose motion is another, or that are dirty, up to
  // date, and calls its dirty() for those that were not: it is to clean them before it returns.
  // True if there was any of either.
  bool update(dxSpace& space, dxGeom* const* geoms, std::size_t slots);
  // The same of one geom's AABB, for another space. Its own learns of it when it updates all.
  void updateOne(dxGeom* geom, Slot slot, std::size_t slots);
  // Whether the motion of a slot's geom was more than half of its smallest side when it was swept.
  // Yes where that is not known.
  bool isFast(Slot slot) const {
    return step_ > 0 && (all_stale_ || (slot < records_.size() && records_[slot].fast));
  }

  // A geom leaves its slot: its AABB is nobody else's business.
  void remove(dxGeom* geom, Slot slot);
  // What Slots::close() will do to the slots.
  void closeSlots(const Buffer<dxGeom*>& geoms);
  void shrink() { records_.shrink_to_fit(); }
  std::size_t bytes() const { return bytesOf(records_); }

 private:
  // What a body will do in the coming step: a shift, and an angle of at most 2, as no point is
  // further from where it was than twice its distance.
  using Motion = std::array<dReal, 4>;
  struct Record {
    Motion motion = {};  // with which the geom's AABB was made
    bool fast = false;
    bool unreported = false;  // made for another space: dirty() is still to be called
  };

  static Motion motionOf(const dxGeom* geom, dReal step);
  static bool extend(dxGeom* geom, const Motion& motion);
  bool makeAABB(dxGeom* geom, Slot slot);
  bool makeRoom(std::size_t slots);

  dReal step_ = 0;
  std::vector<Record> records_;  // by slot; none while all is off
  bool all_stale_ = false;       // with which motion AABBs were made is not known
};

}  // namespace ode_parallel_sap
