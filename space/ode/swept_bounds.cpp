#include "space/ode/swept_bounds.h"

#include <algorithm>
#include <new>

#include "space/base/floating_point.h"
#include "space/geoms/geom_sides.h"
#include "space/geoms/geom_tests.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

// A motion that is no number is none.
SweptBounds::Motion SweptBounds::motionOf(const dxGeom* geom, dReal step) {
  Motion motion = {};
  if (!geom->body || IS_SPACE(geom) || step == 0 || !dBodyIsEnabled(geom->body)) return motion;
  const dReal* const speed = dBodyGetLinearVel(geom->body);
  for (int axis = 0; axis < 3; ++axis) {
    const dReal shift = speed[axis] * step;
    if (shift == shift) motion[axis] = shift;
  }
  const dReal angle = dCalcVectorLength3(dBodyGetAngularVel(geom->body)) * step;
  if (angle == angle) motion[3] = std::min(angle, dReal(2));
  return motion;
}

// Makes the AABB, which is as the geom lies, cover the motion too. Whether that is fast.
bool SweptBounds::extend(dxGeom* geom, const Motion& motion) {
  if (motion == Motion{}) return false;
  const dReal smallest = smallestSide(geom);
  const dReal turned = motion[3] > 0 ? motion[3] * armOf(geom) : 0;
  for (int axis = 0; axis < 3; ++axis) {
    const dReal shift = motion[axis];
    geom->aabb[2 * axis] += std::min(shift, dReal(0)) - turned;
    geom->aabb[2 * axis + 1] += std::max(shift, dReal(0)) + turned;
  }
  return !(2 * (dCalcVectorLength3(motion.data()) + turned) <= smallest);
}

// False where it is as it should be.
bool SweptBounds::makeAABB(dxGeom* geom, Slot slot) {
  if (IS_SPACE(geom)) return false;
  const bool recorded = slot < records_.size();
  const bool dirty = (geom->gflags & GEOM_DIRTY) != 0;
  Motion motion;
  {
    const ScopedMode exact(exactMode());
    motion = motionOf(geom, step_);
    if (!all_stale_ && recorded && !dirty && !records_[slot].unreported &&
        motion == records_[slot].motion)
      return false;
  }
  // Made anew also where ODE takes it for up to date: it may have been swept already.
  geom->gflags |= GEOM_AABB_BAD;
  updateAABB(geom);
  const ScopedMode exact(exactMode());
  const bool fast = extend(geom, motion);
  if (recorded) records_[slot] = {motion, fast, false};
  return true;
}

// A geom that is not dirty stays so: while it is, its space must be, too, and all around this.
void SweptBounds::updateOne(dxGeom* geom, Slot slot, std::size_t slots) {
  const bool room = records_.size() >= slots || makeRoom(slots);
  if (makeAABB(geom, slot) && room) records_[slot].unreported = true;
}

// Without memory for records every AABB is made anew each time.
bool SweptBounds::update(dxSpace& space, dxGeom* const* geoms, std::size_t slots) {
  const bool room = makeRoom(slots);
  bool any = false;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    dxGeom* const geom = geoms[slot];
    if (!geom || !makeAABB(geom, static_cast<Slot>(slot))) continue;
    any = true;
    if (geom->gflags & GEOM_DIRTY) continue;
    geom->gflags |= GEOM_DIRTY;
    space.dirty(geom);
  }
  all_stale_ = !room && step_ > 0;
  if (step_ == 0) std::vector<Record>().swap(records_);
  return any;
}

bool SweptBounds::makeRoom(std::size_t slots) try {
  records_.resize(slots);
  return true;
} catch (const std::bad_alloc&) {
  std::vector<Record>().swap(records_);
  all_stale_ = true;
  return false;
}

// ODE makes no geom dirty that is added to a space.
void SweptBounds::remove(dxGeom* geom, Slot slot) {
  const bool recorded = slot < records_.size();
  if (all_stale_ || (recorded && records_[slot].motion != Motion{}))
    geom->gflags |= GEOM_DIRTY | GEOM_AABB_BAD;
  if (recorded) records_[slot] = {};
}

void SweptBounds::closeSlots(const Buffer<dxGeom*>& geoms) {
  records_.resize(closeGaps(geoms, records_));
}

}  // namespace ode_parallel_sap
