#include "space/base/validate.h"

#include <algorithm>
#include <utility>

#include "space/geoms/ode_private.h"
#include "space/ode/silent_geoms.h"

namespace ode_parallel_sap {

void SilentGeoms::validate(const Buffer<dxGeom*>& geoms) const {
  constexpr char invariant[] = "the lists have the meshes and spaces that listing them anew finds";
  SilentGeoms anew;
  for (Slot slot = 0; slot < geoms.size(); ++slot) {
    const dxGeom* const geom = geoms[slot];
    if (!geom || !(geom->type == dTriMeshClass || IS_SPACE(geom))) continue;
    mustHold(slots_.contains(slot), invariant);
    anew.slots_.growTo(slot + std::size_t{1});
    anew.slots_.insert(slot);
  }
  if (!isListed() || anew.slots_.words() == 0) return;
  anew.listed_ = anew.within_listed_ = false;
  anew.list(geoms.data());
  const Lists none, &now = lists_ ? *lists_ : none, &then = anew.lists_ ? *anew.lists_ : none;
  const auto sorted = [](std::vector<Within> within) {
    std::vector<std::pair<Slot, dxGeom*>> sorted;
    for (const Within& each : within) sorted.emplace_back(each.slot, each.mesh);
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  };
  mustHold(now.meshes == then.meshes && now.spaces == then.spaces && !then.any_stock &&
               sorted(now.within) == sorted(then.within),
           invariant);
}

}  // namespace ode_parallel_sap
