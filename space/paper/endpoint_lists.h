// The boxes sorted by their lower bounds along each axis, and how far their upper ones reach.
#pragma once

#include <cstdint>
#include <utility>

#include "space/base/box_set.h"
#include "space/base/buffer.h"

namespace ode_parallel_sap {

// What follows from the sorted lower bounds of one axis. Boxes are numbered (slots, or numbers
// within a part of the scene); their ranks are their places in the order of their lower bounds. The
// pairs that overlap on the axis lie in rows: row i holds the pairs of the box of rank i with those
// of ranks i + 1 up to, but not including, reach[i], one after the other. So a pair's place in the
// list of all pairs of the axis follows from the ranks of its two boxes.
struct AxisRows {
  Buffer<std::uint32_t> order;   // boxes by rank
  Buffer<std::uint32_t> ranks;   // by box; undefined for those that take no part
  Buffer<std::uint32_t> reach;   // by rank: lower bounds at or below the box's upper one
  Buffer<std::uint64_t> begins;  // by rank: where the row begins in the list; the last one ends it
  // Whether a box's upper bound is below its lower one. Such boxes' own rows are empty; in those of
  // others they are entries that may overlap or not (see overlapsRow).
  bool inverted = false;

  std::uint64_t pairs() const { return begins[order.size()]; }
  // Whether the box of rank `other` overlaps that of rank `row`, in whose row it is.
  bool overlapsRow(std::uint32_t other, std::uint32_t row) const { return reach[other] > row; }
  // The row of the place-th pair.
  std::uint32_t rowOf(std::uint64_t place) const;
  // Fills in `begins` and `inverted`.
  void layOut();
  std::size_t bytes() const { return bytesOf(order, ranks, reach, begins); }
};

// The pairs of the fullest axis are looked up in the emptiest, so that few are left for the third.
struct AxisChoice {
  int fullest, second, third;
};

// From the number of pairs that overlap on each axis.
inline AxisChoice chooseAxes(const std::uint64_t (&pairs)[3]) {
  AxisChoice axes = {0, 1, 2};
  if (pairs[axes.second] > pairs[axes.fullest]) std::swap(axes.second, axes.fullest);
  if (pairs[axes.third] > pairs[axes.fullest]) std::swap(axes.third, axes.fullest);
  if (pairs[axes.third] < pairs[axes.second]) std::swap(axes.third, axes.second);
  return axes;
}

template <class Real>
class EndpointLists {
 public:
  // Makes the rows of these boxes.
  void update(const BoxSet& boxes, int threads);
  const AxisRows& axis(int axis) const { return rows_[axis]; }
  std::size_t bytes() const { return bytesOf(rows_); }

 private:
  AxisRows rows_[3];
};

}  // namespace ode_parallel_sap
