#include "space/paper/endpoint_lists.h"

#include <algorithm>

#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region sorting("end points: axes");

// Closed intervals: a row reaches lower bounds that are equal to the box's upper one.
template <class Real>
void findRows(const BasicBox<Real>* boxes, std::size_t slots, int axis, AxisRows& rows) {
  rows.order.resizeDiscarding(0);
  for (std::size_t slot = 0; slot < slots; ++slot)
    if (isActive(boxes[slot])) rows.order.push_back(static_cast<std::uint32_t>(slot));
  std::uint32_t *const begin = rows.order.begin(), *const end = rows.order.end();
  std::stable_sort(begin, end, [=](std::uint32_t a, std::uint32_t b) {
    return boxes[a].lower[axis] < boxes[b].lower[axis];
  });
  rows.ranks.resizeDiscarding(slots);
  rows.reach.resizeDiscarding(rows.order.size());
  for (std::uint32_t rank = 0; rank < rows.order.size(); ++rank) {
    const std::uint32_t slot = rows.order[rank];
    const auto isBelow = [=](Real upper, std::uint32_t b) { return upper < boxes[b].lower[axis]; };
    rows.ranks[slot] = rank;
    rows.reach[rank] = static_cast<std::uint32_t>(
        std::upper_bound(begin, end, boxes[slot].upper[axis], isBelow) - begin);
  }
  rows.layOut();
}

}  // namespace

std::uint32_t AxisRows::rowOf(std::uint64_t place) const {
  return static_cast<std::uint32_t>(
      std::upper_bound(begins.data(), begins.data() + order.size(), place) - begins.data() - 1);
}

void AxisRows::layOut() {
  const std::size_t count = order.size();
  begins.resizeDiscarding(count + 1);
  inverted = false;
  std::uint64_t place = 0;
  for (std::size_t row = 0; row < count; ++row) {
    begins[row] = place;
    if (reach[row] > row + 1) place += reach[row] - row - 1;
    inverted |= reach[row] <= row;
  }
  begins[count] = place;
}

template <class Real>
void EndpointLists<Real>::update(const BoxSet& boxes, int threads) {
  const int most = teamFor(boxes.size, grains::sorted_members, threads);
  runTeam(sorting, most, [&](int thread, int team) {
    for (int axis = thread; axis < 3; axis += team) {
      noteWork();
      findRows(boxesOf<Real>(boxes), boxes.size, axis, rows_[axis]);
    }
  });
}

template class EndpointLists<float>;
template class EndpointLists<double>;

}  // namespace ode_parallel_sap
