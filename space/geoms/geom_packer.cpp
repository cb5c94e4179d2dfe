#include "space/geoms/geom_packer.h"

namespace ode_parallel_sap {

void UpdateFacts::add(const UpdateFacts& other) {
  moved += other.moved;
  disabled += other.disabled;
  invalid += other.invalid;
  unbounded += other.unbounded;
  coarse += other.coarse;
  user_classes = user_classes || other.user_classes;
  spaces = spaces || other.spaces;
  exact_bits = exact_bits && other.exact_bits;
  exact_boxes = exact_boxes && other.exact_boxes;
  beyond_tolerance = beyond_tolerance || other.beyond_tolerance;
  filter_bits = filter_bits || other.filter_bits;
  filter_bodies = filter_bodies || other.filter_bodies;
  newly_invalid.insert(newly_invalid.end(), other.newly_invalid.begin(), other.newly_invalid.end());
}

void count(SlotState state, std::ptrdiff_t sign, UpdateFacts& facts) {
  facts.disabled += state & disabled_state ? sign : 0;
  facts.invalid += state & invalid_state ? sign : 0;
  facts.unbounded += state & unbounded_state ? sign : 0;
  facts.coarse += state & coarse_state ? sign : 0;
}

// Where silent changes are announced, a step may still put an awake body to sleep; one that a step
// wakes is moved by it.
SlotState GeomPacker::kindOf(const dxGeom* geom, bool resting) const {
  const bool watched =
      rules.notified ? rules.skip_asleep && geom->body && !resting : !resting || geom->body;
  return (watched ? 0 : unwatched_state) | (IS_SPACE(geom) ? space_state : 0) |
         (hasAABBTest(geom) ? user_class_state : 0);
}

// Unless silent changes are announced, geoms at rest are packed as if enabled and with all bits
// set, because few of their changes are noticed here: each frame tests pairs with them again.
SlotState GeomPacker::pack(const dxGeom* geom, Slot slot, UpdateFacts& facts, BoxSet& boxes) const {
  if (!geom) {
    boxes.deactivate(slot);
    return no_box_state | unwatched_state;
  }
  const bool resting = isResting(geom, rules);
  boxes.bodies[slot] = resting ? resting_body : keyOf(geom->body);
  SlotState state = kindOf(geom, resting);
  if (!isEnabled(geom)) {
    state |= disabled_state;
    if (!resting || rules.notified || geom->gflags & GEOM_ZERO_SIZED) {
      boxes.deactivate(slot);
      return state | no_box_state;
    }
  }
  Box box;
  const BoundsFacts rounded = roundToFloats(geom->aabb, box);
  if (rules.tolerance > 0 && exceedsTolerance(geom->aabb, rules.tolerance))
    facts.beyond_tolerance = true;
  if (rounded & nan_bounds) {
    facts.newly_invalid.push_back(slot);
    boxes.deactivate(slot);
    return state | no_box_state | invalid_state;
  }
  if (boxes.wide)
    boxes.wide_boxes[slot] = boxOfBounds<double>(geom->aabb);
  else
    boxes.boxes[slot] = box;
  facts.exact_boxes = facts.exact_boxes && !(rounded & inexact_bounds);
  facts.user_classes = facts.user_classes || state & user_class_state;
  facts.spaces = facts.spaces || state & space_state;
  state |= rounded & (unbounded_bounds | coarse_bounds);
  if (!resting || rules.notified)
    packBits(geom, slot, boxes.bits.data(), boxes.wide_bits.data(), facts);
  else
    boxes.bits[slot] = {~std::uint32_t{0}, ~std::uint32_t{0}};
  if (resting)
    facts.filter_bodies = true;
  else
    packBody(geom, boxes.bodies[slot], facts);
  return state;
}

bool GeomPacker::changedUnnoticed(const dxGeom* geom, Slot slot, SlotState state,
                                  const BoxSet& boxes) const {
  const bool resting = isResting(geom, rules);
  if (resting != (boxes.bodies[slot] == resting_body)) return true;
  if (isEnabled(geom) != !(state & disabled_state)) return true;
  if (state & no_box_state || (resting && !rules.notified)) return false;
  return !hasBitsOf(geom, slot, boxes) || (!resting && boxes.bodies[slot] != keyOf(geom->body));
}

bool GeomPacker::fellAsleep(const dxGeom* geom, Slot slot, const BoxSet& boxes) const {
  return geom->body && isResting(geom, rules) && boxes.bodies[slot] == keyOf(geom->body);
}

}  // namespace ode_parallel_sap
