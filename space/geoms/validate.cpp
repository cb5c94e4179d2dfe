#include "space/base/validate.h"

#include <algorithm>
#include <cstring>

#include "space/base/floating_point.h"
#include "space/geoms/geom_update.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

void Slots::validate(const dxGeom* first, std::size_t count) const {
  constexpr char invariant[] =
      "ODE's list has the geoms of all slots in their order, each with its slot and the pointer to "
      "it";
  for (Slot slot = 0; slot < size(); ++slot) {
    const dxGeom* const geom = geoms_[slot];
    if (!geom) continue;
    mustHold(count-- > 0 && geom == first && slotOf(geom) == slot && *tomes_[slot] == geom,
             invariant);
    first = geom->next;
  }
  mustHold(count == 0 && !first, invariant);
}

void GeomUpdate::validate(dxGeom* const* geoms) const {
  constexpr char invariant[] =
      "boxes, filters and states are those of their geoms, and the facts count the states";
  const ScopedMode mode(exactMode());
  BoxSet anew;
  anew.wide = boxes_.wide;
  anew.resize(boxes_.size);
  UpdateFacts counts, unread;
  for (Slot slot = 0; slot < boxes_.size; ++slot) {
    const dxGeom* const geom = geoms[slot];
    const SlotState known = states_[slot];
    count(known, 1, counts);
    // Against its promise the program did not announce it.
    if (geom && packer_.rules.notified && packer_.changedSilently(geom, slot, known, boxes_))
      continue;
    const SlotState state = packer_.pack(geom, slot, unread, anew);
    // A geom at rest may be disabled unseen. It, or a disabled one, is watched on without its body.
    const bool rests = geom && boxes_.bodies[slot] == resting_body && !packer_.rules.notified;
    const int may_differ = (rests ? disabled_state : 0) |
                           (rests || state & no_box_state ? ~known & unwatched_state : 0);
    mustHold(((state ^ known) & ~may_differ) == 0, invariant);
    const auto areSame = [&](const auto& a, const auto& b) {
      return std::memcmp(&a[slot], &b[slot], sizeof a[slot]) == 0;
    };
    mustHold(boxes_.wide ? areSame(anew.wide_boxes, boxes_.wide_boxes)
                         : areSame(anew.boxes, boxes_.boxes),
             invariant);
    if (state & no_box_state) continue;
    mustHold(areSame(anew.bits, boxes_.bits) && areSame(anew.bodies, boxes_.bodies), invariant);
  }
  mustHold(counts.disabled == facts_.disabled && counts.invalid == facts_.invalid &&
               counts.unbounded == facts_.unbounded && counts.coarse == facts_.coarse,
           invariant);
}

void Edits::validate(const Geoms& geoms) const {
  constexpr char invariant[] = "the table has the geoms of each sub-space that it follows, once";
  if (!tables_) return;
  const auto& all = tables_->known;
  for (const auto& [slot, tracked] : tables_->tracked) {
    if (!geoms[slot] || !isFresh(tracked)) continue;
    std::size_t count = 0;
    const auto isOwn = [slot = slot, scan = tracked.scan](const auto& known) {
      return known.second.slot == slot && known.second.scan == scan;
    };
    for (const Stamped& each : tracked.spaces)
      for (const dxGeom* geom = each.space->first; geom; geom = geom->next) {
        if (IS_SPACE(geom)) continue;
        const auto known = all.find(geom);
        mustHold(known != all.end() && isOwn(*known) && known->second.came <= now_, invariant);
        ++count;
      }
    mustHold(std::size_t(std::count_if(all.begin(), all.end(), isOwn)) == count, invariant);
  }
}

}  // namespace ode_parallel_sap
