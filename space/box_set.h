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
template <class Real>
struct BasicBox {
  Real lower[3], upper[3];
};
using Box = BasicBox<float>;

template <class Real>
inline bool isActive(const BasicBox<Real>& box) {
  return box.lower[0] == box.lower[0];
}

// ODE's category and collide bits. Two geoms may collide if either's category meets the other's
// collide bits.
struct FilterBits {
  std::uint32_t category, collide;
};

// Boxes and filters by slot. Boxes are floats, rounded outward, or, in scenes so far from the
// origin for their size that floats would tell too few of them apart, the exact doubles.
struct BoxSet {
  std::size_t size = 0;  // slots
  bool wide = false;     // which of the two is filled
  Buffer<BasicBox<float>> boxes;
  Buffer<BasicBox<double>> wide_boxes;
  Buffer<FilterBits> bits;       // read if filter_bits
  Buffer<std::uint32_t> bodies;  // read if filter_bodies; equal and not 0: on the same body
  bool filter_bits = false;
  bool filter_bodies = false;
  // Whether the boxes are the exact ones, so that no pair needs the exact test.
  bool exact = false;

  std::size_t bytes() const {
    return boxes.bytes() + wide_boxes.bytes() + bits.bytes() + bodies.bytes();
  }
};

template <class Real>
const BasicBox<Real>* boxesOf(const BoxSet& boxes);
template <>
inline const BasicBox<float>* boxesOf<float>(const BoxSet& boxes) {
  return boxes.boxes.data();
}
template <>
inline const BasicBox<double>* boxesOf<double>(const BoxSet& boxes) {
  return boxes.wide_boxes.data();
}

}  // namespace ode_parallel_sap

#endif
