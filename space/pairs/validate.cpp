#include "space/base/validate.h"
#include "space/pairs/cell_trees.h"

namespace ode_parallel_sap {

template <class Real>
void CellTrees<Real>::validate(const BoxSet& boxes) const {
  constexpr char invariant[] =
      "a node's bounds hold those of all below it, each active box has one place, and all other "
      "places are empty but for those of slots that are gone";
  for (const TreeView<Real>& view : views_)
    for (int depth = 1; depth < view.depth; ++depth)
      for (std::size_t child = 0; child < view.groups[depth - 1]; ++child) {
        const Group<Real>& node = view.levels[depth][child / group_size];
        const std::size_t lane = child % group_size;
        const Group<Real>& below = view.levels[depth - 1][child];
        for (std::size_t i = 0; i < group_size; ++i) {
          if (isEmpty(below, i)) continue;
          for (int axis = 0; axis < 3; ++axis)
            mustHold(node.lower[axis][lane] <= below.lower[axis][i] &&
                         node.upper[axis][lane] >= below.upper[axis][i],
                     invariant);
        }
      }
  const Group<Real>* const of_cells = cells() ? views_[0].levels[0] : nullptr;
  std::size_t count = 0;
  for (std::size_t group = 0; group < cells() + strayRows(); ++group) {
    const Group<Real>& row = group < cells() ? of_cells[group] : stray_boxes_[group - cells()];
    for (std::uint32_t lane = 0; lane < group_size; ++lane) {
      const Slot slot = row.slot[lane];
      if (isEmpty(row, lane)) continue;
      mustHold(places_.size() == 0 || placeOf(slot) == group * group_size + lane, invariant);
      if (slot >= boxes.size) continue;
      const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
      for (int axis = 0; axis < 3; ++axis)
        mustHold(
            row.lower[axis][lane] == box.lower[axis] && row.upper[axis][lane] == box.upper[axis],
            invariant);
      ++count;
    }
  }
  for (Slot slot = 0; slot < boxes.size; ++slot) count -= isActive(boxesOf<Real>(boxes)[slot]);
  mustHold(count == 0, invariant);
}

template void CellTrees<float>::validate(const BoxSet&) const;
template void CellTrees<double>::validate(const BoxSet&) const;

}  // namespace ode_parallel_sap
