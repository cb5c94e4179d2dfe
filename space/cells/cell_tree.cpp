#include "space/cells/cell_tree.h"

#include <limits>
#include <mutex>

#include "space/data/parallel.h"
#include "space/data/tuning.h"

namespace ode_parallel_sap {

namespace {

std::size_t groupsFor(std::size_t children) {
  return (children + group_size - 1) / group_size;
}

Region packing("cell tree: cells");

}  // namespace

template <class Real>
void CellTree<Real>::build(const BoxSet& boxes, const std::uint32_t* order,
                           const std::uint32_t* starts, std::size_t cells, int threads,
                           Levels levels) {
  cell_count_ = cells;
  view_ = {};
  if (cells == 0) return;
  std::size_t total = 0;
  for (std::size_t level_groups = cell_count_;; level_groups = groupsFor(level_groups)) {
    view_.groups[view_.depth++] = static_cast<std::uint32_t>(level_groups);
    total += level_groups;
    if (levels == Levels::cells_only || (level_groups == 1 && view_.depth > 1)) break;
  }
  const bool filtered = boxes.filter_bits || boxes.filter_bodies;
  groups_.resizeDiscarding(total);
  ids_.resizeDiscarding(cell_count_);
  if (filtered) filters_.resizeDiscarding(cell_count_);
  view_.ids = ids_.data();
  view_.filters = filtered ? filters_.data() : nullptr;

  const Kernels<Real>& kernel = kernels<Real>();
  Group<Real>* level = groups_.data();
  for (int depth = 0; depth < view_.depth; ++depth) {
    view_.levels[depth] = level;
    level += view_.groups[depth];
  }
  const auto levelOf = [&](int depth) {
    return groups_.data() + (view_.levels[depth] - groups_.data());
  };
  // Whole parents to a thread, so that each makes the bounds of its own cells at once.
  const int most = teamFor(cell_count_, grains::box_rows, threads);
  filter_summary_ = {};
  std::mutex summing;
  runTeam(packing, most, [&](int thread, int team) {
    const Range range = ownPart(cell_count_, thread, team, group_size);
    kernel.packCells(boxesOf<Real>(boxes), {order, starts}, range.begin, range.end, groups_.data(),
                     ids_.data());
    if (filtered) {
      const FilterSummary summary = packFilters(boxes, starts, range.begin, range.end);
      const std::lock_guard<std::mutex> lock(summing);
      filter_summary_.add(summary);
    }
    if (view_.depth > 1)
      kernel.packBounds(groups_.data(), cell_count_, range.begin / group_size, groupsFor(range.end),
                        levelOf(1));
  });
  for (int depth = 2; depth < view_.depth; ++depth)
    kernel.packBounds(levelOf(depth - 1), view_.groups[depth - 1], 0, view_.groups[depth],
                      levelOf(depth));
}

template <class Real>
void CellTree<Real>::widen(Real part) {
  if (view_.depth < 2) return;
  for (std::uint32_t node = 0; node < view_.groups[1]; ++node) {
    Group<Real>& bounds = groups_[view_.groups[0] + node];
    for (int axis = 0; axis < 3; ++axis)
      for (int lane = 0; lane < group_size; ++lane) {
        const Real margin = (bounds.upper[axis][lane] - bounds.lower[axis][lane]) * part;
        // Not where the bounds are inverted or infinite, or there is no cell.
        if (!(margin > 0 && margin < std::numeric_limits<Real>::infinity())) continue;
        bounds.lower[axis][lane] -= margin;
        bounds.upper[axis][lane] += margin;
      }
  }
  Group<Real>* level = groups_.data() + view_.groups[0];
  for (int depth = 2; depth < view_.depth; ++depth) {
    Group<Real>* const above = level + view_.groups[depth - 1];
    kernels<Real>().packBounds(level, view_.groups[depth - 1], 0, view_.groups[depth], above);
    level = above;
  }
}

template <class Real>
void CellTree<Real>::setBox(std::size_t cell, int lane, const BasicBox<Real>& box) {
  for (int axis = 0; axis < 3; ++axis) {
    groups_[cell].lower[axis][lane] = box.lower[axis];
    groups_[cell].upper[axis][lane] = box.upper[axis];
  }
}

template <class Real>
BasicBox<Real> CellTree<Real>::boundsOf(std::size_t cell) const {
  const Group<Real>& bounds = view_.levels[1][cell / group_size];
  const std::size_t lane = cell % group_size;
  BasicBox<Real> box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lower[axis] = bounds.lower[axis][lane];
    box.upper[axis] = bounds.upper[axis][lane];
  }
  return box;
}

template <class Real>
FilterSummary CellTree<Real>::packFilters(const BoxSet& boxes, const std::uint32_t* starts,
                                          std::size_t begin, std::size_t end) {
  FilterSummary summary;
  for (std::size_t cell = begin; cell < end; ++cell) {
    const int count = static_cast<int>(starts[cell + 1] - starts[cell]);
    for (int lane = 0; lane < group_size; ++lane) {
      const std::uint32_t slot = ids_[cell].slot[lane];
      GroupFilter& filter = filters_[cell];
      filter.category[lane] = boxes.filter_bits ? boxes.bits[slot].category : ~0u;
      filter.collide[lane] = boxes.filter_bits ? boxes.bits[slot].collide : ~0u;
      filter.body[lane] = boxes.filter_bodies ? boxes.bodies[slot] : 0;
      if (lane < count) summary.add(filter.category[lane], filter.collide[lane]);
    }
  }
  return summary;
}

template <class Real>
void CellTree<Real>::renumber(const Slot* slots) {
  for (std::size_t cell = 0; cell < cell_count_; ++cell)
    for (std::uint32_t& slot : ids_[cell].slot) slot = slots[slot];
}

template class CellTree<float>;
template class CellTree<double>;

}  // namespace ode_parallel_sap
