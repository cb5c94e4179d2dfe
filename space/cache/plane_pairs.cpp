#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/packed_pair_rule.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/cache/pair_cache.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

Region meeting("planes: geoms");

}  // namespace

void PlanePairs::take(dxGeom* const* geoms, GeomUpdate& update, int threads) {
  BoxSet& boxes = update.boxes();
  const SlotState* const states = update.states();
  set_.growTo(boxes.size);
  set_.clear();
  if (update.facts().unbounded == 0) return;
  for (Slot slot = 0; slot < boxes.size; ++slot)
    if (states[slot] & unbounded_state && geoms[slot]->type == dPlaneClass) set_.insert(slot);
  const int most = teamFor(boxes.size * set_.count(), grains::geom_tests, threads);
  std::vector<Buffer<Pair>>& parts = pairs_.parts(most);
  runTeam(meeting, most, [&](int thread, int team) {
    const ScopedMode mode(exactMode());
    const Range own = ownPart(boxes.size, thread, team);
    set_.forEach([&](Slot slot) {
      const dxPlane* const plane = static_cast<const dxPlane*>(geoms[slot]);
      for (Slot other = static_cast<Slot>(own.begin); other < own.end; ++other) {
        if (states[other] & no_box_state || other == slot || (other < slot && set_.contains(other)))
          continue;
        const dxGeom* const geom = geoms[other];
        if (!isClearOfPlane(geom->aabb, plane->p) && boxesOverlap(plane, geom) &&
            passesFilters(boxes, slot, other))
          parts[thread].push_back(makePair(std::min(slot, other), std::max(slot, other)));
      }
    });
  });
  pairs_.sort(boxes.size, threads);
  set_.forEach([&](Slot slot) { boxes.deactivate(slot); });
}

void PlanePairs::putBack(dxGeom* const* geoms, BoxSet& boxes, int threads, PairList& pairs) {
  pairs_.replace(set_, threads, pairs);
  const ScopedMode mode(exactMode());
  set_.forEach([&](Slot slot) {
    if (boxes.wide)
      boxes.wide_boxes[slot] = boxOfBounds<double>(geoms[slot]->aabb);
    else
      roundToFloats(geoms[slot]->aabb, boxes.boxes[slot]);
  });
}

}  // namespace ode_parallel_sap
