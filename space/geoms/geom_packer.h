// One geom in, one box out: the innermost step of the update stage. Sees ODE's private headers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/round_to_floats.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

// What the later stages must know of the geoms behind the boxes.
struct UpdateFacts {
  std::size_t moved = 0;  // in this frame
  // Of all geoms.
  std::ptrdiff_t disabled = 0;
  std::ptrdiff_t invalid = 0;
  std::ptrdiff_t unbounded = 0;
  std::ptrdiff_t coarse = 0;  // boxes that floats make clearly larger
  bool user_classes = false;  // AABBTest may decide
  bool spaces = false;        // some geom is a space
  bool exact_bits = true;     // the 32 filter bits of all boxes decide as ODE's 64 would
  bool exact_boxes = true;    // floats decide as the bounds would
  bool filter_bits = false;
  bool filter_bodies = false;
  bool beyond_tolerance = false;    // at some box a step of floats is a large part of the tolerance
  std::vector<Slot> newly_invalid;  // slots that were packed with NaN bounds, ascending

  void add(const UpdateFacts& other);
};

// What a slot adds to the facts, in bits.
using SlotState = std::uint8_t;
enum : SlotState {
  disabled_state = 1,
  invalid_state = nan_bounds,
  unbounded_state = unbounded_bounds,
  coarse_state = coarse_bounds,
  no_box_state = 16,     // takes part in nothing
  unwatched_state = 32,  // no geom; its silent changes are announced, or verifyPairs() sees them
  space_state = 64,
  user_class_state = 128
};

inline void count(SlotState state, std::ptrdiff_t sign, UpdateFacts& facts) {
  facts.disabled += state & disabled_state ? sign : 0;
  facts.invalid += state & invalid_state ? sign : 0;
  facts.unbounded += state & unbounded_state ? sign : 0;
  facts.coarse += state & coarse_state ? sign : 0;
}

// The facts of a part of the geoms, which one thread brings up to date.
struct alignas(64) UpdatePart {
  UpdateFacts facts;
  std::vector<Slot> deferred;  // moved geoms that only one thread may touch

  std::size_t bytes() const { return bytesOf(deferred); }
};

inline BodyKey keyOf(const dxBody* body) {
  return reinterpret_cast<std::uintptr_t>(body);
}

// All bits as 32, the highest for all above it, too: a match of the originals matches here.
inline std::uint32_t foldBits(unsigned long bits) {
  const std::uint64_t wide = bits;
  return static_cast<std::uint32_t>(wide) | (wide >> 32 ? std::uint32_t{1} << 31 : 0);
}
// Whether these decide as the originals would, among others of which that is true: the bits above
// are clear, or set together with the highest, as in ~8ul.
inline bool foldsExactly(unsigned long bits) {
  const std::uint64_t wide = bits;
  return wide >> 32 == 0 || ~wide >> 31 == 0;
}
// Whether a geom that was packed has the same bits.
inline bool hasBitsOf(const dxGeom* geom, Slot slot, const BoxSet& boxes) {
  const unsigned long category = geom->category_bits, collide = geom->collide_bits;
  if (const WideFilterBits* const wide = boxes.wide_bits.data())
    return wide[slot].category == category && wide[slot].collide == collide;
  const FilterBits& bits = boxes.bits[slot];
  return static_cast<std::uint32_t>(category) == bits.category &&
         static_cast<std::uint32_t>(collide) == bits.collide && foldsExactly(category) &&
         foldsExactly(collide);
}

// Beyond this a step of floats is more than a small part of the tolerance. Steps of denormals are
// as long as the least.
inline dReal mostFor(dReal tolerance) {
  constexpr dReal least_steps = 0x1p18;  // fixed: 32 steps in a tolerance
  if (tolerance < 32 * std::numeric_limits<float>::denorm_min()) return 0;
  return std::min<dReal>(tolerance * least_steps, most_bound);
}
// Whether a finite bound lies there.
inline bool exceedsTolerance(const dReal* bounds, dReal tolerance) {
  const dReal limit = mostFor(tolerance);
  bool exceeds = false;
  for (int i = 0; i < 6; ++i) {
    const dReal size = std::fabs(bounds[i]);
    exceeds |= (size > limit) & (size <= std::numeric_limits<dReal>::max());
  }
  return exceeds;
}

// Writes the bits of a geom that takes part, and what they add to the facts.
__attribute__((noinline)) inline void packSomeBits(const dxGeom* geom, FilterBits& bits,
                                                   UpdateFacts& facts) {
  facts.filter_bits = true;
  facts.exact_bits =
      facts.exact_bits && foldsExactly(geom->category_bits) && foldsExactly(geom->collide_bits);
  bits = {foldBits(geom->category_bits), foldBits(geom->collide_bits)};
}
inline void packBits(const dxGeom* geom, Slot slot, FilterBits* all, WideFilterBits* wide,
                     UpdateFacts& facts) {
  FilterBits& bits = all[slot];
  if (wide) wide[slot] = {geom->category_bits, geom->collide_bits};
  if (__builtin_expect((geom->category_bits & geom->collide_bits) != ~0ul, false))
    packSomeBits(geom, bits, facts);
  else
    bits = {~std::uint32_t{0}, ~std::uint32_t{0}};
}

// The same of its body.
inline void packBody(const dxGeom* geom, BodyKey& body, UpdateFacts& facts) {
  body = keyOf(geom->body);
  // Of two geoms on one body at least one is followed by another in the body's list.
  if (geom->body_next) facts.filter_bodies = true;
}

// Needs exactMode(). The geoms are clean.
class GeomPacker {
 public:
  PairRules rules;

  // Writes box, bits and body of a slot to `boxes`. No geom: an empty slot.
  SlotState pack(const dxGeom* geom, Slot slot, UpdateFacts& facts, BoxSet& boxes) const;
  // Whether a geom that was packed with `state` has other bits, another body or is enabled where it
  // was not: ODE does not announce that.
  bool changedSilently(const dxGeom* geom, Slot slot, SlotState state, const BoxSet& boxes) const;
  // Whether its body was awake when it was packed and now sleeps.
  bool fellAsleep(const dxGeom* geom, Slot slot, const BoxSet& boxes) const;
};

inline void UpdateFacts::add(const UpdateFacts& other) {
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

// Unless silent changes are announced, geoms at rest are packed as if enabled and with all bits
// set, because few of their changes are found here: each frame tests pairs with them again.
inline SlotState GeomPacker::pack(const dxGeom* geom, Slot slot, UpdateFacts& facts,
                                  BoxSet& boxes) const {
  if (!geom) {
    boxes.deactivate(slot);
    return no_box_state | unwatched_state;
  }
  const bool resting = rules.isResting(geom);
  boxes.bodies[slot] = resting ? resting_body : keyOf(geom->body);
  // Even where changes are announced, a step may put a body to sleep. One that it wakes moves.
  const bool watched =
      rules.notified ? rules.skip_asleep && geom->body && !resting : !resting || geom->body;
  SlotState state = (watched ? 0 : unwatched_state) | (IS_SPACE(geom) ? space_state : 0) |
                    (hasAABBTest(geom) ? user_class_state : 0);
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

inline bool GeomPacker::changedSilently(const dxGeom* geom, Slot slot, SlotState state,
                                        const BoxSet& boxes) const {
  const bool resting = rules.isResting(geom);
  if (resting != (boxes.bodies[slot] == resting_body)) return true;
  if (isEnabled(geom) != !(state & disabled_state)) return true;
  if (state & no_box_state || (resting && !rules.notified)) return false;
  return !hasBitsOf(geom, slot, boxes) || (!resting && boxes.bodies[slot] != keyOf(geom->body));
}

inline bool GeomPacker::fellAsleep(const dxGeom* geom, Slot slot, const BoxSet& boxes) const {
  return geom->body && rules.isResting(geom) && boxes.bodies[slot] == keyOf(geom->body);
}

// The same in few instructions for most geoms: enabled, neither spaces nor of a user's class, with
// bounded boxes of floats, by rules that leave no pair out. By value: what is written could, for
// all that a compiler knows, change what is pointed to.
class PlainPacker {
 public:
  // Makes all states those of most geoms.
  PlainPacker(const PairRules& rules, BoxSet& boxes, Buffer<SlotState>& states)
      : boxes_(rules.leavesOutResting() || boxes.wide ? nullptr : boxes.boxes.data()),
        bits_(boxes.bits.data()),
        wide_bits_(boxes.wide_bits.data()),
        bodies_(boxes.bodies.data()),
        states_(states.data()),
        tolerant_(rules.tolerance > 0),
        most_step_(coarse_share *
                   (tolerant_ ? static_cast<float>(mostFor(rules.tolerance)) : most_bound)) {
    std::fill(states.begin(), states.end(), SlotState(rules.notified ? unwatched_state : 0));
  }

  // False: GeomPacker has to do it.
  bool pack(const dxGeom* geom, Slot slot, UpdateFacts& facts) const {
    static_assert(dFirstSpaceClass < dFirstUserClass, "all classes below are neither");
    if (!boxes_ || !geom || geom->type >= dFirstSpaceClass ||
        (geom->gflags & GEOM_ENABLE_TEST_MASK) != GEOM_ENABLE_TEST_VALUE)
      return false;
    if (__builtin_expect(!roundFine(geom->aabb, most_step_, boxes_[slot], facts.exact_boxes),
                         false) &&
        !packOther(geom, slot, facts))
      return false;
    packBits(geom, slot, bits_, wide_bits_, facts);
    packBody(geom, bodies_[slot], facts);
    return true;
  }

 private:
  // A box that may be coarse.
  bool packOther(const dxGeom* geom, Slot slot, UpdateFacts& facts) const {
    const BoundsFacts rounded = roundToFloats(geom->aabb, boxes_[slot]);
    if (tolerant_ || rounded & (nan_bounds | unbounded_bounds)) return false;
    if (rounded & inexact_bounds) facts.exact_boxes = false;
    if (rounded & coarse_bounds) {
      states_[slot] |= coarse_state;
      ++facts.coarse;
    }
    return true;
  }

  Box* boxes_;  // null: nothing is plain
  FilterBits* bits_;
  WideFilterBits* wide_bits_;  // null: not kept
  BodyKey* bodies_;
  SlotState* states_;
  bool tolerant_;
  float most_step_;
};

}  // namespace ode_parallel_sap
