// A scene cut along its fullest axis, for several devices.
#pragma once

#include <cstdint>

#include "space/base/buffer.h"
#include "space/paper/axis_lists.h"

namespace ode_parallel_sap {

// What one device is in charge of: a segment of the pairs of the fullest axis, and the boxes that
// occur in them. These are numbered anew, by their order on that axis; the rows of all three axes
// are those of these boxes alone. Boxes near a cut belong to both sides, a pair to one.
class AxisPart {
 public:
  // The part-th of `parts` parts with equal numbers of pairs of the fullest axis. With one part
  // boxes keep their numbers and `whole` is used as it is: it must outlive the part. Not to be
  // copied.
  void cut(const AxisRows (&whole)[3], const AxisChoice& axes, int part, int parts);

  const AxisRows& rows(int axis) const { return *rows_[axis]; }
  // The pairs [begin, end) of its fullest axis are this part's; its other pairs are another's.
  std::uint64_t begin() const { return begin_; }
  std::uint64_t end() const { return end_; }
  Slot slotOf(std::uint32_t box) const { return slots_ ? slots_[box] : box; }
  std::size_t bytes() const { return bytesOf(own_, before_, numbers_, member_); }

 private:
  void restrict(const AxisRows& whole, AxisRows& rows);

  const AxisRows* rows_[3] = {};
  std::uint64_t begin_ = 0, end_ = 0;
  const std::uint32_t* slots_ = nullptr;
  std::uint32_t count_ = 0;
  AxisRows own_[3];
  Buffer<std::uint32_t> before_;   // by rank on another axis: boxes of the part of lower ranks
  Buffer<std::uint32_t> numbers_;  // by slot: the box's number, of those that are in the part
  Buffer<std::uint8_t> member_;    // by rank on another axis
};

}  // namespace ode_parallel_sap
