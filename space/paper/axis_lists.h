// Overlapping pairs of each axis as lists, and the pairs common to all three.
#pragma once

#include <cstdint>
#include <utility>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/pairs/row_table.h"

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
inline AxisChoice chooseAxes(const AxisRows (&rows)[3]) {
  AxisChoice axes = {0, 1, 2};
  const auto hasMore = [&](int a, int b) { return rows[a].pairs() > rows[b].pairs(); };
  if (hasMore(axes.second, axes.fullest)) std::swap(axes.second, axes.fullest);
  if (hasMore(axes.third, axes.fullest)) std::swap(axes.third, axes.fullest);
  if (hasMore(axes.second, axes.third)) std::swap(axes.third, axes.second);
  return axes;
}

// Sorts the boxes by their lower bounds along each axis, and finds how far their upper ones reach.
void sortAxes(const BoxSet& boxes, int threads, AxisRows (&rows)[3]);

// The system of Avril, Gouranton and Arnaldi ("Collision Detection: Broad Phase Adaptation from
// Multi-Core to Multi-GPU Architecture", section 5.1), on the CPU: boxes are sorted along each
// axis, all pairs that overlap on an axis become a list, and each pair of the longest list is
// looked up in the second one; what both hold is looked up in the third.
//
// A list has 4 bytes a pair, and a scene has n^(5/3) pairs an axis at least, n^2 in the worst case:
// the method is a yardstick. A pair's place in a list follows from the ranks of its boxes
// (AxisRows), so that a look-up reads one entry.
class AxisLists final : public PairFinder {
 public:
  // Throws ListsTooLong, with the boxes sorted and no memory taken for pairs.
  using PairFinder::find;
  int find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) override;
  std::size_t bytes() const override { return bytesOf(rows_, lists_, found_); }

 private:
  void reserveLists();
  void meet(const BoxSet& boxes, const AxisChoice& axes, std::uint64_t begin, std::uint64_t end,
            int thread);

  AxisRows rows_[3];
  Buffer<Slot> lists_[3];
  RowTable found_;
};

}  // namespace ode_parallel_sap
