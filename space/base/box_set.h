// The boxes of one frame: what the update stage hands to the extraction, on whatever back end.
#pragma once

#include <cstdint>
#include <limits>
#include <type_traits>

#include "space/base/buffer.h"

namespace ode_parallel_sap {

// Slots number the geoms of a space in the order in which they were last added, gaps allowed. Pairs
// are pairs of slots, and ascending slots are the order of the report. Slots stay below 2^28.
using Slot = std::uint32_t;

// An axis-aligned box. All bounds NaN: a slot that takes part in nothing.
template <class Real>
struct BasicBox {
  Real lower[3], upper[3];
};
using Box = BasicBox<float>;

template <class Real>
inline bool isActive(const BasicBox<Real>& box) {
  return box.lower[0] == box.lower[0];
}

template <class Real>
constexpr BasicBox<Real> inactiveBox() {
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN();
  return {{nan, nan, nan}, {nan, nan, nan}};
}

// The exact box, of bounds as ODE keeps them: lower and upper on each axis.
template <class Real, class Bound>
inline BasicBox<Real> boxOfBounds(const Bound* bounds) {
  return {{bounds[0], bounds[2], bounds[4]}, {bounds[1], bounds[3], bounds[5]}};
}

// ODE's category and collide bits. Two geoms may collide if either's category meets the other's
// collide bits.
struct FilterBits {
  std::uint32_t category, collide;
};
struct WideFilterBits {
  std::uint64_t category, collide;
};

// A body's address; 0: no body.
using BodyKey = std::uint64_t;
// Stands for the bodies of geoms at rest, no pairs of which are wanted. No body lies there.
constexpr BodyKey resting_body = 1;

// Boxes and filters by slot. Boxes are the nearest floats (round_to_floats.h), or, in scenes so far
// from the origin for their size that floats would tell too few of them apart, the exact doubles.
struct BoxSet {
  std::size_t size = 0;  // slots
  bool wide = false;     // which of the two is filled
  Buffer<BasicBox<float>> boxes;
  Buffer<BasicBox<double>> wide_boxes;
  Buffer<FilterBits> bits;           // read if filter_bits
  Buffer<WideFilterBits> wide_bits;  // all of a geom's, if these do not decide alike
  // Equal and not 0, if filter_bodies: on the same body, or both at rest, and no pair.
  Buffer<BodyKey> bodies;
  bool filter_bits = false;
  bool filter_bodies = false;
  bool exact = false;  // whether no pair needs the exact test

  // Room for so many slots, with what there was.
  void resize(std::size_t slots) {
    size = slots;
    wide ? wide_boxes.resize(slots) : boxes.resize(slots);
    bits.resize(slots);
    if (wide_bits.data()) wide_bits.resize(slots);
    bodies.resize(slots);
  }
  void deactivate(Slot slot) {
    if (wide)
      wide_boxes[slot] = inactiveBox<double>();
    else
      boxes[slot] = inactiveBox<float>();
  }
  std::size_t bytes() const { return bytesOf(boxes, wide_boxes, bits, wide_bits, bodies); }
};

template <class Real>
Buffer<BasicBox<Real>>& boxBufferOf(BoxSet& boxes) {
  if constexpr (std::is_same<Real, float>::value)
    return boxes.boxes;
  else
    return boxes.wide_boxes;
}
template <class Real>
const BasicBox<Real>* boxesOf(const BoxSet& boxes) {
  return boxBufferOf<Real>(const_cast<BoxSet&>(boxes)).data();
}

}  // namespace ode_parallel_sap
