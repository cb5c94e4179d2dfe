#include "space/geoms/geom_packer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "space/base/round_to_floats.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

// All bits as 32, of which the highest stands for all above it, too: a match of the originals is
// always a match of these.
std::uint32_t foldBits(unsigned long bits) {
  const std::uint64_t wide = bits;
  return static_cast<std::uint32_t>(wide) | (wide >> 32 ? std::uint32_t{1} << 31 : 0);
}
// Whether these decide as the originals would, among others of which that is true: the bits above
// are clear, or set together with the highest, as in ~8ul.
bool foldsExactly(unsigned long bits) {
  const std::uint64_t wide = bits;
  return wide >> 32 == 0 || ~wide >> 31 == 0;
}

// Whether a step of floats at one of the bounds is more than a small part of the tolerance, or the
// bound is beyond all floats.
bool exceedsTolerance(const dReal* bounds, dReal tolerance) {
  constexpr dReal least_steps = 0x1p18;  // fixed: 32 steps in a tolerance
  const dReal limit = std::min<dReal>(tolerance * least_steps, most_bound);
  bool exceeds = false;
  for (int i = 0; i < 6; ++i) {
    const dReal size = std::fabs(bounds[i]);
    exceeds |= (size > limit) & (size <= std::numeric_limits<dReal>::max());
  }
  return exceeds;
}

// Writes the bits of a geom that takes part, and what they add to the facts.
void packBits(const dxGeom* geom, Slot slot, UpdateFacts& facts, BoxSet& boxes) {
  constexpr unsigned long all = ~0ul;
  if (__builtin_expect((geom->category_bits & geom->collide_bits) == all, true)) {
    boxes.bits[slot] = {~std::uint32_t{0}, ~std::uint32_t{0}};
    return;
  }
  facts.filter_bits = true;
  facts.exact_bits =
      facts.exact_bits && foldsExactly(geom->category_bits) && foldsExactly(geom->collide_bits);
  boxes.bits[slot] = {foldBits(geom->category_bits), foldBits(geom->collide_bits)};
}

// The same of its body.
void packBody(const dxGeom* geom, Slot slot, UpdatePart& part, BoxSet& boxes) {
  UpdateFacts& facts = part.facts;
  const std::uintptr_t body = reinterpret_cast<std::uintptr_t>(geom->body);
  const std::uint32_t number = numberOf(geom->body);
  boxes.bodies[slot] = number;
  if (!body) return;
  if (!part.some_body) part.some_body = body;
  // Of two geoms on one body at least one is followed by another in the body's list.
  facts.filter_bodies = facts.filter_bodies || geom->body_next;
  if ((body ^ part.some_body) & ~body_bits || number == 0 || number == resting_number)
    facts.exact_bodies = false;
}

}  // namespace

void UpdateFacts::add(const UpdateFacts& other) {
  moved += other.moved;
  disabled += other.disabled;
  invalid += other.invalid;
  unbounded += other.unbounded;
  coarse += other.coarse;
  user_classes = user_classes || other.user_classes;
  spaces = spaces || other.spaces;
  exact_bits = exact_bits && other.exact_bits;
  exact_bodies = exact_bodies && other.exact_bodies;
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
         (hasAABBTest(geom, rules.tested_classes) ? user_class_state : 0);
}

// Most geoms are enabled and neither spaces nor of a user's class, with a bounded box of floats:
// they add nothing else to their slots' states.
SlotState GeomPacker::pack(const dxGeom* geom, Slot slot, UpdatePart& part, BoxSet& boxes) const {
  static_assert(dFirstSpaceClass < dFirstUserClass, "all classes below are neither");
  if (rules.skip() || boxes.wide || !geom || geom->type >= dFirstSpaceClass ||
      (geom->gflags & GEOM_ENABLE_TEST_MASK) != GEOM_ENABLE_TEST_VALUE)
    return packOther(geom, slot, part, boxes);
  Box& box = boxes.boxes[slot];
  const BoundsFacts rounded = roundToFloats(geom->aabb, box);
  if (rounded.nan || rounded.unbounded) return packOther(geom, slot, part, boxes);
  part.facts.exact_boxes = part.facts.exact_boxes && rounded.exact;
  if (rules.tolerance > 0 && exceedsTolerance(geom->aabb, rules.tolerance))
    part.facts.beyond_tolerance = true;
  packBits(geom, slot, part.facts, boxes);
  packBody(geom, slot, part, boxes);
  return (rules.notified ? unwatched_state : 0) | (rounded.coarse ? coarse_state : 0);
}

// Unless silent changes are announced, geoms at rest are packed as if enabled and with all bits
// set, because few of their changes are noticed here: each frame tests pairs with them again.
SlotState GeomPacker::packOther(const dxGeom* geom, Slot slot, UpdatePart& part,
                                BoxSet& boxes) const {
  if (!geom) {
    boxes.deactivate(slot);
    return no_box_state | unwatched_state;
  }
  UpdateFacts& facts = part.facts;
  const bool resting = isResting(geom, rules);
  boxes.bodies[slot] = resting ? resting_number : numberOf(geom->body);
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
  if (rounded.nan) {
    facts.newly_invalid.push_back(slot);
    boxes.deactivate(slot);
    return state | no_box_state | invalid_state;
  }
  if (boxes.wide)
    boxes.wide_boxes[slot] = boxOfBounds<double>(geom->aabb);
  else
    boxes.boxes[slot] = box;
  facts.exact_boxes = facts.exact_boxes && rounded.exact;
  facts.user_classes = facts.user_classes || state & user_class_state;
  facts.spaces = facts.spaces || state & space_state;
  state |= (rounded.unbounded ? unbounded_state : 0) | (rounded.coarse ? coarse_state : 0);
  if (!resting || rules.notified)
    packBits(geom, slot, facts, boxes);
  else
    boxes.bits[slot] = {~std::uint32_t{0}, ~std::uint32_t{0}};
  if (resting)
    facts.filter_bodies = true;
  else
    packBody(geom, slot, part, boxes);
  return state;
}

bool GeomPacker::changedUnnoticed(const dxGeom* geom, Slot slot, SlotState state,
                                  const BoxSet& boxes) const {
  const bool resting = isResting(geom, rules);
  if (resting != (boxes.bodies[slot] == resting_number)) return true;
  if (isEnabled(geom) != !(state & disabled_state)) return true;
  if (state & no_box_state || (resting && !rules.notified)) return false;
  return boxes.bits[slot].category != foldBits(geom->category_bits) ||
         boxes.bits[slot].collide != foldBits(geom->collide_bits) ||
         !foldsExactly(geom->category_bits) || !foldsExactly(geom->collide_bits) ||
         (!resting && boxes.bodies[slot] != numberOf(geom->body));
}

bool GeomPacker::fellAsleep(const dxGeom* geom, Slot slot, const BoxSet& boxes) const {
  return geom->body && isResting(geom, rules) && boxes.bodies[slot] == numberOf(geom->body);
}

}  // namespace ode_parallel_sap
