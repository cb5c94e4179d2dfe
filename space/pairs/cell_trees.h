// Trees of bounds over cells of sixteen boxes, one for each class of cells, sixteen children to a
// node.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/platform.h"
#include "space/pairs/cell_order.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// Puts a box into a place of sixteen.
template <class Real>
inline void put(const BasicBox<Real>& box, Group<Real>& group, int lane) {
  for (int axis = 0; axis < 3; ++axis) {
    group.lower[axis][lane] = box.lower[axis];
    group.upper[axis][lane] = box.upper[axis];
  }
}

template <class Real>
class CellTrees {
 public:
  // The cells of all classes are numbered through. The order is read during the call only.
  void build(const BoxSet& boxes, const CellOrder<Real>& order, int threads);
  // Puts another box into a place, if it is not NaN and the bounds of the cell hold it, or may grow
  // and will not be much longer than the box. Else false, and the place keeps its box. Where they
  // may not grow, many threads may do so at once for different places.
  bool moveBox(std::size_t cell, int lane, const BasicBox<Real>& box, bool may_grow);
  void removeBox(std::size_t cell, int lane) { put(inactiveBox<Real>(), groups_[cell], lane); }
  // Asks for what these change.
  void prefetchCell(std::size_t cell) const {
    for (int axis = 0; axis < 3; ++axis) {
      prefetch(groups_[cell].lower[axis]);
      prefetch(groups_[cell].upper[axis]);
    }
  }
  std::size_t count() const { return views_.size(); }
  // One a class, an empty one where it has no cells. Valid until the next build, and none at all
  // after one that threw.
  const TreeView<Real>* views() const { return views_.data(); }
  std::size_t cells() const {
    return views_.empty() ? 0 : views_.back().first_cell + cells(views_.size() - 1);
  }
  std::size_t cells(std::size_t tree) const {
    return views_[tree].depth ? views_[tree].groups[0] : 0;
  }
  // A node's bounds hold those of all below it.
  void validate() const;
  std::size_t bytes() const { return bytesOf(groups_, filters_, views_); }

 private:
  Group<Real>* level(const TreeView<Real>& view, int depth) {
    return groups_.data() + (view.levels[depth] - groups_.data());
  }
  void layOut(const std::vector<std::uint32_t>& class_ends, bool filtered);
  void packFilters(const BoxSet& boxes, std::size_t begin, std::size_t end);
  const TreeView<Real>& treeOf(std::size_t cell) const;

  Buffer<Group<Real>> groups_;  // the cells of all trees, then the upper levels of each
  Buffer<GroupFilter> filters_;
  std::vector<TreeView<Real>> views_;
};

}  // namespace ode_parallel_sap
