#include "space/ode/silent_geoms.h"

#include <algorithm>
#include <new>
#include <utility>

#include "space/base/tuning.h"
#include "space/geoms/geom_tests.h"
#include "space/ode/ode_space.h"

namespace ode_parallel_sap {

namespace {

bool isDirty(const dxGeom* geom) {
  return (geom->gflags & GEOM_DIRTY) != 0;
}

// Of a geom that is in a space of ours: whether that space and all around it know that it is dirty,
// and will make their AABBs anew. dGeomGetAABB of a space clears GEOM_AABB_BAD, and what is dirty
// stays so.
bool isToldDirty(const dxGeom* geom) {
  return isDirty(geom) && geom->gflags & told_dirty && geom->parent_space->gflags & GEOM_AABB_BAD;
}

bool mayBeSilent(const dxGeom* geom) {
  return geom->type == dTriMeshClass || IS_SPACE(geom);
}

// Simple and hash spaces clean the dirty geoms in front of their lists. ODE, which may be going
// through such a list, would miss a geom that comes to the front.
// Spaces of ours that stand in for these do not.
bool cleansFront(dxSpace* space) {
  return (space->type == dSimpleSpaceClass || space->type == dHashSpaceClass) &&
         !parallelSAPSpace(space);
}

void markDirty(dxSpace* space, dxGeom* geom) {
  if (!cleansFront(space) && (space->lock_count == 0 || parallelSAPSpace(space)))
    space->dirty(geom);
}

// So that a space which cleans the front cleans all that are dirty.
void makeDirtyToLast(dxSpace* space) {
  dxGeom* last = nullptr;
  for (dxGeom* geom = space->first; geom; geom = geom->next)
    if (isDirty(geom)) last = geom;
  for (dxGeom* geom = space->first; last && geom != last; geom = geom->next)
    geom->gflags |= GEOM_DIRTY;
}

// Brings the geoms of dirty spaces of ours up to date: of this geom, or of those within it. Whether
// there is one. The stock spaces around it are to clean it, too.
bool cleanOurs(dxGeom* geom) {
  if (!IS_SPACE(geom) || !isDirty(geom)) return false;
  dxSpace* const space = static_cast<dxSpace*>(geom);
  if (parallelSAPSpace(space)) {
    space->cleanGeoms();
    return true;
  }
  bool any = false;
  for (dxGeom* own = space->first; own; own = own->next) any = cleanOurs(own) || any;
  if (any && cleansFront(space)) makeDirtyToLast(space);
  return any;
}

// What dGeomMoved does to the spaces around a geom, but without its assertion that they are not
// locked. Marks them in each other's lists, if `marking`: also those that are dirty, which another
// space may not know of. Stops before `end`.
void makeDirty(dxSpace* space, bool marking, const dxSpace* end = nullptr) {
  for (; space != end; space = space->parent_space) {
    space->gflags |= GEOM_DIRTY | GEOM_AABB_BAD;
    if (marking && space->parent_space != end) markDirty(space->parent_space, space);
  }
}

// Where there is no memory to list them. Lists keep their order while they are gone through.
bool makeDirtyAround(dxSpace* space) {
  bool any = false;
  for (dxGeom* geom = space->first; geom; geom = geom->next) {
    if (IS_SPACE(geom) ? makeDirtyAround(static_cast<dxSpace*>(geom))
                       : geom->type == dTriMeshClass && isDirty(geom)) {
      makeDirty(space, false);
      any = true;
    }
  }
  return any;
}

}  // namespace

void SilentGeoms::renumber(const Buffer<dxGeom*>& geoms) {
  slots_.clear();
  changed_.clear();
  listed_ = within_listed_ = false;
  for (Slot slot = 0; slot < geoms.size(); ++slot)
    if (mayBeSilent(geoms[slot])) slots_.insert(slot);
}

// Mostly none is: flags are read without a branch. The meshes of a dirty sub-space may be gone.
bool SilentGeoms::anyDirty() const {
  int flags = 0;
  for (const dxGeom* mesh : lists_->meshes) flags |= mesh->gflags;
  if (lists_->any_stock)
    for (const dxGeom* space : lists_->spaces) flags |= space->gflags;
  if (flags & GEOM_DIRTY) return true;
  for (const Within& within : lists_->within) flags |= within.mesh->gflags;
  return (flags & GEOM_DIRTY) != 0;
}

bool SilentGeoms::addMeshes(Slot slot, std::vector<Within>& meshes) const {
  if (!lists_) return false;
  for (dxGeom* const mesh : lists_->meshes) meshes.push_back({slot, mesh});
  for (const Within& within : lists_->within) meshes.push_back({slot, within.mesh});
  return lists_->any_stock;
}

void SilentGeoms::listWithin(dxSpace* space, Slot slot) {
  if (ParallelSAPSpace* const own = parallelSAPSpace(space)) {
    if (own->addMeshes(slot, lists_->within)) lists_->any_stock = true;
    return;
  }
  lists_->any_stock = true;
  for (dxGeom* geom = space->first; geom; geom = geom->next) {
    if (geom->type == dTriMeshClass) lists_->within.push_back({slot, geom});
    if (IS_SPACE(geom)) listWithin(static_cast<dxSpace*>(geom), slot);
  }
}

// Of the sub-spaces only those that changed are gone through, if the others are listed.
void SilentGeoms::list(dxGeom* const* geoms) {
  const bool all = !within_listed_;
  listed_ = within_listed_ = false;  // should memory end
  slots_.forEach([&](Slot slot) {
    if (!mayBeSilent(geoms[slot])) slots_.erase(slot);
  });
  if (slots_.count() > 0 && !made(lists_)) throw std::bad_alloc();
  if (Lists* const lists = lists_.get()) {
    const auto isOther = [&](Slot slot) {
      return all || changed_.contains(slot) || (lists->any_stock && isDirty(geoms[slot]));
    };
    const auto isOld = [&](const Within& within) { return isOther(within.slot); };
    lists->within.erase(std::remove_if(lists->within.begin(), lists->within.end(), isOld),
                        lists->within.end());
    lists->meshes.clear();
    lists->spaces.clear();
    lists->large.clear();
    lists->any_stock = lists->any_stock && !all;
    slots_.forEach([&](Slot slot) {
      dxGeom* const geom = geoms[slot];
      (IS_SPACE(geom) ? lists->spaces : lists->meshes).push_back(geom);
      if (!IS_SPACE(geom)) return;
      dxSpace* const space = static_cast<dxSpace*>(geom);
      if (space->count > static_cast<int>(small_scene_slots))
        if (ParallelSAPSpace* const own = parallelSAPSpace(space)) lists->large.push_back(own);
      if (isOther(slot)) listWithin(space, slot);
    });
  }
  changed_.clear();
  listed_ = within_listed_ = true;
}

void SilentGeoms::cleanWithin(dxGeom* const* geoms) const {
  slots_.forEach([&](Slot slot) { cleanOurs(geoms[slot]); });
}

void SilentGeoms::check(dxSpace& space, dxGeom* const* geoms) {
  bool any = false, listed = false;
  std::vector<dxSpace*> fronts;  // of spaces with dirty geoms
  try {
    if (!isListed()) list(geoms);
    listed = true;
    dxSpace* marked = nullptr;
    for (std::size_t i = 0; lists_ && i < lists_->within.size(); ++i) {
      const Within& within = lists_->within[i];
      if (!isDirty(within.mesh)) continue;
      dxSpace* const around = within.mesh->parent_space;
      markDirty(around, within.mesh);
      if (std::exchange(marked, around) == around) continue;
      const dxSpace* const end = isToldDirty(geoms[within.slot]) ? &space : nullptr;
      makeDirty(around, true, end);
      for (dxSpace* each = around; each != end; each = each->parent_space)
        if (cleansFront(each)) fronts.push_back(each);
    }
    std::sort(fronts.begin(), fronts.end());
    fronts.erase(std::unique(fronts.begin(), fronts.end()), fronts.end());
    for (dxSpace* const front : fronts) makeDirtyToLast(front);
  } catch (const std::bad_alloc&) {
    any = makeDirtyAround(&space);
  }
  slots_.forEach([&](Slot slot) {
    if (!mayBeSilent(geoms[slot]) || !isDirty(geoms[slot]) || isToldDirty(geoms[slot])) return;
    space.dirty(geoms[slot]);
    any = any || !IS_SPACE(geoms[slot]);
  });
  if (listed) {  // dirty() has called for other lists, but nothing came or left
    listed_ = within_listed_ = true;
    changed_.clear();
  }
  if (!any) return;
  const bool was_dirty = isDirty(&space);
  makeDirty(&space, true);
  for (dxSpace* each = space.parent_space; each && !was_dirty; each = each->parent_space)
    if (cleansFront(each)) makeDirtyToLast(each);
}

}  // namespace ode_parallel_sap
