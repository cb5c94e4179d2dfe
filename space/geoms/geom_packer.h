// One geom in, one box out: the innermost step of the update stage. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/geoms/pack_rules.h"

struct dxBody;
struct dxGeom;

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
  bool exact_bodies = true;   // 32 bits of the bodies' addresses tell them apart
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
  invalid_state = 2,
  unbounded_state = 4,
  coarse_state = 8,
  no_box_state = 16,     // takes part in nothing
  unwatched_state = 32,  // no geom, or one whose silent changes are announced or seen by pair
  space_state = 64,
  user_class_state = 128
};

void count(SlotState state, std::ptrdiff_t sign, UpdateFacts& facts);

// What one thread learned of its geoms.
struct alignas(64) UpdatePart {
  UpdateFacts facts;
  std::vector<Slot> deferred;  // moved geoms that only one thread may touch
  std::uintptr_t some_body = 0;

  std::size_t bytes() const { return bytesOf(deferred); }
};

// Bits 4 to 35 of an address tell bodies apart as long as their other bits are alike.
constexpr std::uintptr_t body_bits = std::uintptr_t{0xffffffff} << 4;

inline std::uint32_t numberOf(const dxBody* body) {
  return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(body) >> 4);
}

// Needs exactMode(). The geoms are clean.
class GeomPacker {
 public:
  PackRules rules;

  // Writes box, bits and body number of a slot to `boxes`. No geom: an empty slot.
  SlotState pack(const dxGeom* geom, Slot slot, UpdatePart& part, BoxSet& boxes) const;
  // Whether a geom that was packed with `state` has other bits, another body or is enabled where it
  // was not: nobody tells a space of that.
  bool changedUnnoticed(const dxGeom* geom, Slot slot, SlotState state, const BoxSet& boxes) const;
  // Whether its body was awake when it was packed and now sleeps.
  bool fellAsleep(const dxGeom* geom, Slot slot, const BoxSet& boxes) const;

 private:
  SlotState packOther(const dxGeom* geom, Slot slot, UpdatePart& part, BoxSet& boxes) const;
  SlotState kindOf(const dxGeom* geom, bool resting) const;
};

}  // namespace ode_parallel_sap
