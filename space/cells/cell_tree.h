// A tree of bounds, sixteen children to a node, over cells of sixteen boxes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/cells/filter_groups.h"
#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

template <class Real>
class CellTree {
 public:
  enum class Levels { cells_only, all };

  // Cell i gets the boxes order[starts[i]] to order[starts[i + 1] - 1], sixteen at most; order ==
  // null stands for 0, 1, 2, ... Both are read during the call only.
  void build(const BoxSet& boxes, const std::uint32_t* order, const std::uint32_t* starts,
             std::size_t cells, int threads, Levels levels = Levels::all);
  // Widens the bounds of every cell by `part` of its extents, so that its boxes have room to move.
  void widen(Real part);
  // Puts another box into a place, all NaN for none. It stays within boundsOf(cell).
  void setBox(std::size_t cell, int lane, const BasicBox<Real>& box);
  // What the tree takes for the bounds of a cell's boxes. Needs all levels.
  BasicBox<Real> boundsOf(std::size_t cell) const;

  // Slot i becomes slots[i].
  void renumber(const Slot* slots);
  // Valid until the next build.
  const TreeView<Real>& view() const { return view_; }
  std::size_t cells() const { return cell_count_; }
  // Of the boxes at the last build, if the view has filters.
  const FilterSummary& filters() const { return filter_summary_; }
  std::size_t bytes() const { return bytesOf(groups_, ids_, filters_); }

 private:
  FilterSummary packFilters(const BoxSet& boxes, const std::uint32_t* starts, std::size_t begin,
                            std::size_t end);

  std::size_t cell_count_ = 0;
  Buffer<Group<Real>> groups_;  // all levels, one after the other
  Buffer<GroupIds> ids_;
  Buffer<GroupFilter> filters_;
  FilterSummary filter_summary_;
  TreeView<Real> view_ = {};
};

}  // namespace ode_parallel_sap
