// Packs geoms in blocks: most of them are plain, and need few of the questions that GeomPacker
// asks. Sees ODE's private headers.
#pragma once

#include <cstdint>

#include "space/data/round_outward.h"
#include "space/geom/geom_tests.h"
#include "space/update/geom_packer.h"

namespace ode_parallel_sap {

// What the geoms of a block add to the facts is gathered here, and handed over at its end. Lives
// within one block. Needs exactMode(). The geoms are clean.
class BlockPacker {
 public:
  BlockPacker(const GeomPacker& packer, UpdatePart& part, BoxSet& boxes)
      : packer_(packer),
        part_(part),
        boxes_(boxes),
        plain_rules_(!packer.rules.skip() && packer.rules.tolerance == 0 && !boxes.wide),
        plain_state_(packer.rules.notified ? SlotState{unwatched_state} : SlotState{0}),
        some_body_(part.some_body) {}
  ~BlockPacker() {
    UpdateFacts& facts = part_.facts;
    if (!part_.some_body) part_.some_body = some_body_;
    // That of the part may have come from another geom of this block.
    if (some_body_) unlike_ |= part_.some_body ^ some_body_;
    facts.exact_boxes = facts.exact_boxes && exact_boxes_;
    facts.filter_bodies = facts.filter_bodies || shared_bodies_;
    if (unlike_ & ~body_bits || !exact_numbers_) facts.exact_bodies = false;
  }
  BlockPacker(const BlockPacker&) = delete;
  BlockPacker& operator=(const BlockPacker&) = delete;

  // As GeomPacker::pack() does, and with the same result.
  SlotState pack(const dxGeom* geom, Slot slot) {
    return plain_rules_ && geom && packPlain(geom, slot) ? plain_state_ : packOther(geom, slot);
  }

 private:
  // A geom that is enabled and neither a space nor of a user's class, with a box that is fine in
  // floats: that adds nothing to its slot's state. False for any other.
  bool packPlain(const dxGeom* geom, Slot slot) {
    static_assert(dFirstSpaceClass < dFirstUserClass, "all classes below are neither");
    if (geom->type >= dFirstSpaceClass ||
        (geom->gflags & GEOM_ENABLE_TEST_MASK) != GEOM_ENABLE_TEST_VALUE)
      return false;
    Box box;
    const BoundsFacts rounded = roundOutward(geom->aabb, box);
    if (rounded.nan || rounded.unbounded || rounded.coarse) return false;
    boxes_.boxes[slot] = box;
    exact_boxes_ = exact_boxes_ && rounded.exact;
    packFilters(geom, slot);
    return true;
  }

  // Packs all of a plain geom but its box.
  void packFilters(const dxGeom* geom, Slot slot) {
    constexpr unsigned long all = ~0ul;
    if (__builtin_expect((geom->category_bits & geom->collide_bits) == all, true))
      boxes_.bits[slot] = {~std::uint32_t{0}, ~std::uint32_t{0}};
    else
      GeomPacker::packBits(geom, slot, part_.facts, boxes_);
    packBody(geom, slot);
  }

  void packBody(const dxGeom* geom, Slot slot) {
    const std::uintptr_t body = reinterpret_cast<std::uintptr_t>(geom->body);
    const std::uint32_t number = numberOf(geom->body);
    boxes_.bodies[slot] = number;
    if (!body) return;
    if (!some_body_) some_body_ = body;
    unlike_ |= body ^ some_body_;
    shared_bodies_ = shared_bodies_ || geom->body_next;
    exact_numbers_ = exact_numbers_ && number != 0 && number != resting_number;
  }

  __attribute__((noinline)) SlotState packOther(const dxGeom* geom, Slot slot) {
    return packer_.pack(geom, slot, part_, boxes_);
  }

  const GeomPacker& packer_;
  UpdatePart& part_;
  BoxSet& boxes_;
  const bool plain_rules_;
  const SlotState plain_state_;            // of plain geoms, as GeomPacker has it under these rules
  std::uintptr_t some_body_, unlike_ = 0;  // bits in which bodies' addresses differ
  bool exact_boxes_ = true, exact_numbers_ = true, shared_bodies_ = false;
};

}  // namespace ode_parallel_sap
