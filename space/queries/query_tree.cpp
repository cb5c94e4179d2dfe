#include "space/queries/query_tree.h"

#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/mechanisms.h"
#include "space/queries/tuning.h"

namespace ode_parallel_sap {

namespace {

template <class Real>
bool contains(const BasicBox<Real>& bounds, const BasicBox<Real>& box) {
  bool inside = true;
  for (int axis = 0; axis < 3; ++axis)
    inside =
        inside && bounds.lower[axis] <= box.lower[axis] && box.upper[axis] <= bounds.upper[axis];
  return inside;
}

template <class Real>
void put(Group<Real>& group, int lane, const BasicBox<Real>& box) {
  for (int axis = 0; axis < 3; ++axis) {
    group.lower[axis][lane] = box.lower[axis];
    group.upper[axis][lane] = box.upper[axis];
  }
}

}  // namespace

template <class Real>
void QueryTree<Real>::build(const BoxSet& boxes, int threads) {
  const ScopedMode mode(exactMode());
  stray_boxes_.resizeDiscarding(0);
  stray_ids_.resizeDiscarding(0);
  free_strays_.resizeDiscarding(0);
  Buffer<std::uint64_t> workspace;
  order_.build(boxes, threads, workspace);
  places_.resizeDiscarding(boxes.size);
  std::fill(places_.begin(), places_.end(), nowhere);
  const CellBoxes of = order_.boxesOfCells();
  trees_.build(boxes, of, order_.classes(), threads);
  if (mechanisms::wide_query_cells) trees_.widen(static_cast<Real>(cell_margin));
  for (std::size_t cell = 0; cell < cells(); ++cell)
    for (std::uint32_t i = of.starts[cell]; i < of.starts[cell + 1]; ++i)
      places_[of.order[i]] = static_cast<std::uint32_t>(cell * group_size + (i - of.starts[cell]));
}

template <class Real>
bool QueryTree<Real>::fits(Slot slot, const BasicBox<Real>& box) const {
  if (!isActive(box)) return true;
  if (slot >= places_.size() || places_[slot] == nowhere) return false;
  const std::size_t cell = places_[slot] / group_size;
  return cell < cells() && contains(trees_.boundsOf(cell), box);
}

template <class Real>
void QueryTree<Real>::place(Slot slot, const BasicBox<Real>& box) {
  if (slot >= places_.size() && !isActive(box)) return;
  places_.growTo(slot + std::size_t{1}, nowhere);
  const std::uint32_t place = places_[slot];
  if (place == nowhere) {
    if (isActive(box)) addStray(slot, box);
    return;
  }
  const std::size_t cell = place / group_size;
  const int lane = place % group_size;
  if (cell >= cells()) {
    setStray(place, box);
    if (isActive(box)) return;
    free_strays_.push_back(place);
    places_[slot] = nowhere;
    return;
  }
  if (contains(trees_.boundsOf(cell), box)) {
    trees_.setBox(cell, lane, box);
    return;
  }
  trees_.setBox(cell, lane, inactiveBox<Real>());
  places_[slot] = nowhere;
  if (isActive(box)) addStray(slot, box);
}

template <class Real>
void QueryTree<Real>::setStray(std::uint32_t place, const BasicBox<Real>& box) {
  put(stray_boxes_[place / group_size - cells()], place % group_size, box);
}

template <class Real>
void QueryTree<Real>::addStray(Slot slot, const BasicBox<Real>& box) {
  if (free_strays_.size() == 0) {
    const std::size_t row = stray_boxes_.size();
    stray_boxes_.resize(row + 1);
    stray_ids_.resize(row + 1);
    for (int lane = group_size - 1; lane >= 0; --lane) {
      put(stray_boxes_[row], lane, inactiveBox<Real>());
      stray_ids_[row].slot[lane] = 0;
      free_strays_.push_back(static_cast<std::uint32_t>((cells() + row) * group_size + lane));
    }
  }
  const std::uint32_t place = free_strays_[free_strays_.size() - 1];
  free_strays_.resize(free_strays_.size() - 1);
  setStray(place, box);
  stray_ids_[place / group_size - cells()].slot[place % group_size] = slot;
  places_[slot] = place;
}

template <class Real>
std::size_t QueryTree<Real>::find(const BasicBox<Real>& box, Slot* found) const {
  Group<Real> query;
  put(query, 0, box);
  const Kernels<Real>& kernel = kernels<Real>();
  std::size_t count = 0;
  for (std::size_t i = 0; i < trees_.count(); ++i)
    if (trees_.cells(i)) count += kernel.findInTree(trees_.views()[i], query, found + count);
  return count + kernel.findInCells(stray_boxes_.data(), stray_ids_.data(), stray_boxes_.size(),
                                    query, found + count);
}

template <class Real>
void QueryTree<Real>::releaseScratch() {
  order_ = CellOrder<Real>();
}

template <class Real>
void QueryTree<Real>::release() {
  *this = QueryTree();
}

template class QueryTree<float>;
template class QueryTree<double>;

}  // namespace ode_parallel_sap
