#include "cuda/axis_lists/axis_parts.h"

#include <algorithm>
#include <cstring>

#include "space/base/parallel.h"

namespace ode_parallel_sap {

// The rows of the boxes slots_[0 .. count_), with their numbers instead of slots. A box's rank
// among them is the number of them before it, and so is how far its row reaches.
void AxisPart::restrict(const AxisRows& whole, AxisRows& rows) {
  const std::size_t boxes = whole.order.size();
  member_.resizeDiscarding(boxes);
  std::memset(member_.data(), 0, boxes);
  for (std::uint32_t box = 0; box < count_; ++box) {
    member_[whole.ranks[slots_[box]]] = 1;
    numbers_[slots_[box]] = box;
  }
  before_.resizeDiscarding(boxes + 1);
  rows.order.resizeDiscarding(count_);
  rows.ranks.resizeDiscarding(count_);
  rows.reach.resizeDiscarding(count_);
  std::uint32_t before = 0;
  for (std::size_t rank = 0; rank < boxes; ++rank) {
    before_[rank] = before;
    if (!member_[rank]) continue;
    const std::uint32_t box = numbers_[whole.order[rank]];
    rows.order[before] = box;
    rows.ranks[box] = before++;
  }
  before_[boxes] = before;
  for (std::uint32_t box = 0; box < count_; ++box)
    rows.reach[rows.ranks[box]] = before_[whole.reach[whole.ranks[slots_[box]]]];
  rows.layOut();
}

void AxisPart::cut(const AxisRows (&whole)[3], const AxisChoice& axes, int part, int parts) {
  const AxisRows& fullest = whole[axes.fullest];
  const Range range = partOf(fullest.pairs(), part, parts);
  begin_ = range.begin;
  end_ = range.end;
  if (parts == 1) {
    for (int axis = 0; axis < 3; ++axis) rows_[axis] = &whole[axis];
    slots_ = nullptr;
    return;
  }
  std::uint32_t first = 0, last = 0;  // ranks on the fullest axis
  if (begin_ < end_) {
    first = fullest.rowOf(begin_);
    const std::uint32_t last_row = fullest.rowOf(end_ - 1);
    last = *std::max_element(fullest.reach.data() + first, fullest.reach.data() + last_row + 1);
    begin_ -= fullest.begins[first];
    end_ -= fullest.begins[first];
  } else {
    begin_ = end_ = 0;
  }
  slots_ = fullest.order.data() + first;
  count_ = last - first;
  numbers_.resizeDiscarding(fullest.ranks.size());
  for (int axis = 0; axis < 3; ++axis) {
    restrict(whole[axis], own_[axis]);
    rows_[axis] = &own_[axis];
  }
}

}  // namespace ode_parallel_sap
