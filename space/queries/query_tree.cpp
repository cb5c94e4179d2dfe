#include "space/queries/query_tree.h"

#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region numbering("query tree: places");

}  // namespace

template <class Real>
void QueryTree<Real>::build(const BoxSet& boxes, int threads) {
  const ScopedMode mode(exactMode());
  stray_boxes_.resizeDiscarding(0);
  strays_ = 0;
  CellOrder<Real> order;
  Buffer<std::uint64_t> workspace;
  order.build(boxes, threads, workspace);
  places_.resizeDiscarding(boxes.size);
  std::fill(places_.begin(), places_.end(), nowhere);
  trees_.build(boxes, order, threads);
  const CellBoxes of = order.boxesOfCells();
  runTeam(numbering, teamFor(cells(), grains::cells, threads), [&](int thread, int team) {
    const Range own = ownPart(cells(), thread, team);
    for (std::size_t cell = own.begin; cell < own.end; ++cell)
      for (std::uint32_t i = of.starts[cell]; i < of.starts[cell + 1]; ++i)
        places_[of.order[i]] =
            static_cast<std::uint32_t>(cell * group_size + (i - of.starts[cell]));
  });
}

template <class Real>
void QueryTree<Real>::place(Slot slot, const BasicBox<Real>& box) {
  if (slot >= places_.size() && !isActive(box)) return;
  places_.growTo(slot + std::size_t{1}, nowhere);
  std::uint32_t place = places_[slot];
  if (place < cells() * group_size) {
    if (trees_.moveBox(place / group_size, place % group_size, box, /*may_grow=*/true)) return;
    trees_.removeBox(place / group_size, place % group_size);
    places_[slot] = place = nowhere;
  }
  if (place == nowhere) {
    if (!isActive(box)) return;
    places_[slot] = place = addStray(slot);
  }
  put(box, stray_boxes_[place / group_size - cells()], place % group_size);
}

template <class Real>
std::uint32_t QueryTree<Real>::addStray(Slot slot) {
  const int lane = strays_ % group_size;
  const std::size_t row = strays_ / group_size;
  if (lane == 0) {
    stray_boxes_.resize(row + 1);
    for (int i = 0; i < group_size; ++i) put(inactiveBox<Real>(), stray_boxes_[row], i);
  }
  stray_boxes_[row].slot[lane] = slot;
  return static_cast<std::uint32_t>(cells() * group_size + strays_++);
}

template <class Real>
std::size_t QueryTree<Real>::find(const BasicBox<Real>& box, std::uint32_t* found) const {
  Group<Real> query;
  put(box, query, 0);
  query.slot[0] = ~std::uint32_t{0};
  const Kernels<Real>& kernel = kernels<Real>();
  std::size_t count = 0;
  for (std::size_t i = 0; i < trees_.count(); ++i)
    if (trees_.cells(i)) count += kernel.findInTree(trees_.views()[i], query, found + count);
  return count + kernel.findInCells(stray_boxes_.data(), stray_boxes_.size(), query, found + count);
}

template class QueryTree<float>;
template class QueryTree<double>;

}  // namespace ode_parallel_sap
