#include "space/pairs/cell_trees.h"

#include <algorithm>
#include <utility>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

static Region packing("cell trees: cells"), numbering("cell trees: places");

// Makes room for all levels, and the views of it. There are none while that may fail.
template <class Real>
void CellTrees<Real>::layOut(const std::vector<std::uint32_t>& class_ends, bool filtered) {
  views_.clear();
  std::vector<TreeView<Real>> views(class_ends.size());
  std::uint32_t cells = 0;
  std::size_t nodes = 0;
  for (std::size_t tree = 0; tree < views.size(); ++tree) {
    TreeView<Real>& view = views[tree];
    std::size_t groups = class_ends[tree] - cells;
    view.first_cell = std::exchange(cells, class_ends[tree]);
    if (groups == 0) continue;
    view.groups[view.depth++] = static_cast<std::uint32_t>(groups);
    while (groups > 1 || view.depth < 2) {
      groups = groupsFor(groups);
      view.groups[view.depth++] = static_cast<std::uint32_t>(groups);
      nodes += groups;
    }
  }
  groups_.resizeDiscarding(cells + nodes);
  if (filtered) filters_.resizeDiscarding(cells);
  Group<Real>* upper = groups_.data() + cells;
  for (TreeView<Real>& view : views) {
    view.levels[0] = groups_.data() + view.first_cell;
    view.filters = filtered ? filters_.data() + view.first_cell : nullptr;
    for (int depth = 1; depth < view.depth; ++depth) {
      view.levels[depth] = upper;
      upper += view.groups[depth];
    }
  }
  views_ = std::move(views);
}

template <class Real>
void CellTrees<Real>::build(const BoxSet& boxes, const CellOrder<Real>& order, int threads) {
  stray_boxes_.resizeDiscarding(0);
  strays_ = 0;
  slots_ = boxes.size;
  places_.resizeDiscarding(0);
  const bool filtered = boxes.filter_bits || boxes.filter_bodies;
  layOut(order.classEnds(), filtered);
  const Kernels<Real>& kernel = kernels<Real>();
  std::size_t nodes = 0;
  for (std::size_t tree = 0; tree < views_.size(); ++tree) nodes += groupsFor(cells(tree));
  // Whole parents to a task, which makes the bounds of its cells at once.
  const int team = teamFor(cells(), grains::cells, threads);
  runChunks(
      packing, team, nodes, taskSize(nodes, team),
      [&](const Range& own, int) {
        std::size_t first_node = 0;  // of a tree
        for (std::size_t tree = 0; tree < views_.size() && first_node < own.end; ++tree) {
          const TreeView<Real>& view = views_[tree];
          const std::size_t tree_nodes = groupsFor(cells(tree));
          const std::size_t begin = std::max(own.begin, first_node) - first_node;
          const std::size_t end = std::min(own.end - first_node, tree_nodes);
          first_node += tree_nodes;
          if (begin >= end) continue;
          const std::size_t first = view.first_cell + begin * group_size;
          const std::size_t last = view.first_cell + std::min(end * group_size, cells(tree));
          kernel.packCells(boxesOf<Real>(boxes), order.boxesOfCells(), first, last, groups_.data());
          kernel.packBounds(view.levels[0], cells(tree), begin, end, level(view, 1));
          if (filtered) packFilters(boxes, first, last);
        }
      },
      team);
  for (const TreeView<Real>& view : views_)
    for (int depth = 2; depth < view.depth; ++depth)
      kernel.packBounds(view.levels[depth - 1], view.groups[depth - 1], 0, view.groups[depth],
                        level(view, depth));
}

template <class Real>
void CellTrees<Real>::build(const BoxSet& boxes, int threads) {
  const ScopedMode mode(exactMode());
  CellOrder<Real> order;
  Buffer<std::uint64_t> workspace;
  order.build(boxes, threads, workspace);
  build(boxes, order, threads);
  numberPlaces(threads);
}

template <class Real>
void CellTrees<Real>::numberPlaces(int threads) {
  if (places_.size() > 0) return;
  places_.growTo(slots_, nowhere);
  runTeam(numbering, teamFor(cells(), grains::cells, threads), [&](int thread, int team) {
    const Range own = ownPart(cells(), thread, team);
    for (std::size_t cell = own.begin; cell < own.end; ++cell)
      for (std::uint32_t lane = 0; lane < group_size; ++lane)
        if (!isEmpty(groups_[cell], lane))
          places_[groups_[cell].slot[lane]] = static_cast<std::uint32_t>(cell * group_size + lane);
  });
}

template <class Real>
void CellTrees<Real>::place(Slot slot, const BasicBox<Real>& box) {
  if (slot >= places_.size() && !isActive(box)) return;
  places_.growTo(slot + std::size_t{1}, nowhere);
  std::uint32_t& place = places_[slot];
  if (place < cells() * group_size) {
    if (move(place, box, /*may_grow=*/true)) return;
    put(inactiveBox<Real>(), groups_[place / group_size], place % group_size);
    place = nowhere;
  }
  if (place == nowhere) {
    if (!isActive(box)) return;
    const int lane = strays_ % group_size;
    const std::size_t row = strays_ / group_size;
    if (lane == 0) {
      stray_boxes_.resize(row + 1);
      for (int i = 0; i < group_size; ++i) put(inactiveBox<Real>(), stray_boxes_[row], i);
    }
    stray_boxes_[row].slot[lane] = slot;
    place = static_cast<std::uint32_t>(cells() * group_size + strays_++);
  }
  put(box, stray_boxes_[place / group_size - cells()], place % group_size);
}

template <class Real>
void CellTrees<Real>::prefetchPlace(Slot slot) const {
  const std::size_t cell = placeOf(slot) / group_size;
  for (int axis = 0; cell < cells() && axis < 3; ++axis) {
    prefetch(groups_[cell].lower[axis]);
    prefetch(groups_[cell].upper[axis]);
  }
}

// Puts another box into a place of a cell, if it is not NaN and the bounds of the cell hold it, or
// may grow and will not be much longer than the box, as it is or was. Else false, and the place
// keeps its box. The bounds above the cell grow with its own.
template <class Real>
bool CellTrees<Real>::move(std::uint32_t place, const BasicBox<Real>& box, bool may_grow) {
  if (!isActive(box)) return false;
  const std::size_t cell = place / group_size, at = place % group_size;
  Group<Real>& boxes = groups_[cell];
  std::size_t tree = 0;
  while (cell - views_[tree].first_cell >= cells(tree)) ++tree;
  const TreeView<Real>& view = views_[tree];
  std::size_t child = cell - view.first_cell;
  Group<Real>* bounds = &level(view, 1)[child / group_size];
  std::size_t lane = child % group_size;
  bool grows = false;
  for (int axis = 0; axis < 3; ++axis) {
    const Real lower = std::min(bounds->lower[axis][lane], box.lower[axis]);
    const Real upper = std::max(bounds->upper[axis][lane], box.upper[axis]);
    const bool outside =
        !(lower == bounds->lower[axis][lane] && upper == bounds->upper[axis][lane]);
    const Real length =
        std::min(box.upper[axis] - box.lower[axis], boxes.upper[axis][at] - boxes.lower[axis][at]);
    if (outside && !(may_grow && upper - lower <= Real(cell_lengths) * length)) return false;
    grows |= outside;
  }
  for (int depth = 1; grows; ++depth) {
    for (int axis = 0; axis < 3; ++axis) {
      Real &lower = bounds->lower[axis][lane], &upper = bounds->upper[axis][lane];
      lower = std::min(lower, box.lower[axis]);
      upper = std::max(upper, box.upper[axis]);
    }
    child /= group_size;
    lane = child % group_size;
    if (depth + 1 == view.depth) break;
    bounds = &level(view, depth + 1)[child / group_size];
  }
  put(box, boxes, at);
  return true;
}

template <class Real>
void CellTrees<Real>::packFilters(const BoxSet& boxes, std::size_t begin, std::size_t end) {
  for (std::size_t cell = begin; cell < end; ++cell)
    for (int lane = 0; lane < group_size; ++lane) {
      const std::uint32_t slot = groups_[cell].slot[lane];
      GroupFilter& filter = filters_[cell];
      filter.category[lane] = boxes.filter_bits ? boxes.bits[slot].category : ~0u;
      filter.collide[lane] = boxes.filter_bits ? boxes.bits[slot].collide : ~0u;
      filter.body[lane] = boxes.filter_bodies ? boxes.bodies[slot] : 0;
    }
}

template <class Real>
std::size_t CellTrees<Real>::find(const BasicBox<Real>& box, std::uint32_t* found) const {
  Group<Real> query;
  put(box, query, 0);
  query.slot[0] = ~std::uint32_t{0};
  const Kernels<Real>& kernel = kernels<Real>();
  std::size_t all = 0;
  for (std::size_t i = 0; i < count(); ++i)
    if (cells(i)) all += kernel.findInTree(views_[i], query, found + all);
  return all + kernel.findInCells(stray_boxes_.data(), stray_boxes_.size(), query, found + all);
}

template class CellTrees<float>;
template class CellTrees<double>;

}  // namespace ode_parallel_sap
