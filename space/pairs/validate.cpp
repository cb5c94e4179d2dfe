#include "space/base/validate.h"
#include "space/pairs/cell_trees.h"

namespace ode_parallel_sap {

template <class Real>
void CellTrees<Real>::validate() const {
  constexpr char invariant[] = "a node's bounds hold those of all below it";
  const auto has = [](const Group<Real>& group, std::size_t lane) {
    return group.lower[0][lane] == group.lower[0][lane];
  };
  for (const TreeView<Real>& view : views_)
    for (int depth = 1; depth < view.depth; ++depth)
      for (std::size_t child = 0; child < view.groups[depth - 1]; ++child) {
        const Group<Real>& node = view.levels[depth][child / group_size];
        const std::size_t lane = child % group_size;
        const Group<Real>& below = view.levels[depth - 1][child];
        for (std::size_t i = 0; i < group_size; ++i) {
          if (!has(below, i)) continue;
          for (int axis = 0; axis < 3; ++axis)
            mustHold(node.lower[axis][lane] <= below.lower[axis][i] &&
                         node.upper[axis][lane] >= below.upper[axis][i],
                     invariant);
        }
      }
}

template void CellTrees<float>::validate() const;
template void CellTrees<double>::validate() const;

}  // namespace ode_parallel_sap
