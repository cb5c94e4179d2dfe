#include "space/ode/silent_geoms.h"

#include <new>
#include <utility>

#include "space/ode/ode_space.h"

namespace ode_parallel_sap {

namespace {

bool isDirty(const dxGeom* geom) {
  return (geom->gflags & GEOM_DIRTY) != 0;
}

// A stock space that is going through its list must not be told to put it into another order.
void tell(dxSpace* space, dxGeom* geom) {
  if (space->lock_count == 0 || dynamic_cast<ParallelSAPSpace*>(space)) space->dirty(geom);
}

void addMeshesOf(dxSpace* space, std::vector<dxGeom*>& meshes) {
  if (ParallelSAPSpace* const own = dynamic_cast<ParallelSAPSpace*>(space)) {
    own->addMeshes(meshes);
    return;
  }
  for (dxGeom* geom = space->first; geom; geom = geom->next) {
    if (geom->type == dTriMeshClass) meshes.push_back(geom);
    if (IS_SPACE(geom)) addMeshesOf(static_cast<dxSpace*>(geom), meshes);
  }
}

// Where there is no memory to list them. No list is put into another order while it is gone
// through.
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

void makeDirty(dxSpace* space, bool telling) {
  for (; space; space = space->parent_space) {
    const bool was_dirty = isDirty(space);
    space->gflags |= GEOM_DIRTY | GEOM_AABB_BAD;
    if (telling && !was_dirty && space->parent_space) tell(space->parent_space, space);
  }
}

bool mayBeSilent(const dxGeom* geom) {
  return geom->type == dTriMeshClass || IS_SPACE(geom);
}

// A sub-space that stays where it is keeps its list. A geom that is new is dirty.
void SilentGeoms::list(dxGeom* const* geoms) {
  slots_.forEach([&](Slot slot) {
    if (!mayBeSilent(geoms[slot])) slots_.erase(slot);
  });
  std::vector<Watched> watched;
  watched.reserve(slots_.count());
  auto before = watched_.begin();
  slots_.forEach([&](Slot slot) {
    while (before != watched_.end() && before->slot < slot) ++before;
    const bool same =
        before != watched_.end() && before->slot == slot && before->geom == geoms[slot];
    watched.push_back(same ? std::move(*before) : Watched{slot, geoms[slot], {}});
  });
  watched_ = std::move(watched);
}

// What a dirty one holds may be other geoms than before. It is told of them when it is clean again:
// its own list may have them in front already.
void SilentGeoms::askSubspace(Watched& subspace) {
  const bool was_dirty = isDirty(subspace.geom);
  if (was_dirty || !subspace.listed) {
    subspace.listed = false;  // should memory end
    subspace.meshes.clear();
    addMeshesOf(static_cast<dxSpace*>(subspace.geom), subspace.meshes);
    subspace.listed = true;
  }
  for (dxGeom* const mesh : subspace.meshes) {
    if (!isDirty(mesh)) continue;
    if (!was_dirty) tell(mesh->parent_space, mesh);
    makeDirty(mesh->parent_space, true);
  }
}

// As most of the time none is, the flags are looked at without a branch. What a dirty sub-space
// held when it was listed may be gone.
bool SilentGeoms::anyDirty() const {
  const dxGeom* const* geom = asked_.data();
  const dxGeom* const* const spaces_end = geom + asked_spaces_;
  const dxGeom* const* const end = geom + asked_.size();
  int flags = 0;
  for (; geom < spaces_end; ++geom) flags |= (*geom)->gflags;
  if (flags & GEOM_DIRTY) return true;
  for (; geom < end; ++geom) flags |= (*geom)->gflags;
  return (flags & GEOM_DIRTY) != 0;
}

void SilentGeoms::listAsked() {
  asked_.clear();
  for (const Watched& watched : watched_)
    if (IS_SPACE(watched.geom)) asked_.push_back(watched.geom);
  asked_spaces_ = asked_.size();
  for (const Watched& watched : watched_) {
    if (!IS_SPACE(watched.geom)) asked_.push_back(watched.geom);
    asked_.insert(asked_.end(), watched.meshes.begin(), watched.meshes.end());
  }
}

void SilentGeoms::askAll(dxSpace& space, dxGeom* const* geoms) try {
  if (!listed_) list(geoms);
  listed_ = false;  // should memory end
  bool any = false;
  for (Watched& watched : watched_) {
    if (IS_SPACE(watched.geom)) askSubspace(watched);
    if (!isDirty(watched.geom)) continue;
    space.dirty(watched.geom);
    any = true;
  }
  if (any) makeDirty(&space, true);
  listAsked();
  listed_ = true;
} catch (const std::bad_alloc&) {
  makeDirtyAround(&space);
  for (dxGeom* geom = space.first; geom; geom = geom->next)
    if (mayBeSilent(geom) && isDirty(geom)) space.dirty(geom);
}

void SilentGeoms::addMeshes(dxGeom* const* geoms, std::vector<dxGeom*>& meshes) {
  slots_.forEach([&](Slot slot) {
    dxGeom* const geom = geoms[slot];
    if (geom->type == dTriMeshClass) meshes.push_back(geom);
    if (IS_SPACE(geom)) addMeshesOf(static_cast<dxSpace*>(geom), meshes);
  });
}

}  // namespace ode_parallel_sap
