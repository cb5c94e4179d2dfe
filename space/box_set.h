// The boxes of one frame: what the update stage hands to the extraction, on whatever back end.
#ifndef ODE_PARALLEL_SAP_BOX_SET_H
#define ODE_PARALLEL_SAP_BOX_SET_H

#include <cstdint>

#include "buffer.h"

namespace ode_parallel_sap {

// Slots number the geoms of a space in the order in which they were last added, gaps allowed. Pairs
// are pairs of slots, and ascending slots are the order of the report. Slots stay below 2^28.
using Slot = std::uint32_t;

// An axis-aligned box that contains the exact one. All bounds NaN: a slot that takes part in
// nothing.
struct Box {
  float lower[3], upper[3];
};

inline bool isActive(const Box& box) {
  return box.lower[0] == box.lower[0];
}

// ODE's category and collide bits. Two geoms may collide if either's category meets the other's
// collide bits.
struct FilterBits {
  std::uint32_t category, collide;
};

// Boxes and filters by slot.
struct BoxSet {
  std::size_t size = 0;  // slots
  Buffer<Box> boxes;
  Buffer<FilterBits> bits;       // read if filter_bits
  Buffer<std::uint32_t> bodies;  // read if filter_bodies; equal and not 0: on the same body
  bool filter_bits = false;
  bool filter_bodies = false;
  // Whether the float boxes are the exact ones, so that no pair needs the exact test.
  bool exact = false;
};

}  // namespace ode_parallel_sap

#endif
