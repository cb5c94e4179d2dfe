#include "space/base/validate.h"

#include <type_traits>

#include "space/base/round_to_floats.h"
#include "space/queries/geom_tree.h"
#include "space/queries/ray_bounds.h"

namespace ode_parallel_sap {

template <class Real>
void QueryTree<Real>::validate(const BoxSet& boxes) const {
  constexpr char invariant[] = "each active box has one place, and all other places are empty";
  trees_.validate();
  const Group<Real>* const of_cells = cells() ? trees_.views()[0].levels[0] : nullptr;
  std::size_t count = 0;
  for (std::size_t group = 0; group < cells() + strayRows(); ++group) {
    const Group<Real>& row = group < cells() ? of_cells[group] : stray_boxes_[group - cells()];
    for (std::uint32_t lane = 0; lane < group_size; ++lane) {
      const Slot slot = row.slot[lane];
      if (row.lower[0][lane] != row.lower[0][lane] || slot >= boxes.size) continue;
      const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
      mustHold(placeOf(slot) == group * group_size + lane, invariant);
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

template void QueryTree<float>::validate(const BoxSet&) const;
template void QueryTree<double>::validate(const BoxSet&) const;

void GeomTree::validate(const Geoms& geoms) const {
  withTrees([&](const auto& of) {
    using Real = typename std::remove_reference_t<decltype(of[0])>::RealType;
    for (int kind = 0; kind < kinds; ++kind) {
      BoxSet boxes;
      boxes.wide = sizeof(Real) > sizeof(float);
      boxes.resize(geoms.size());
      for (Slot slot = 0; slot < geoms.size(); ++slot) {
        boxes.deactivate(slot);
        const dxGeom* const geom = geoms[slot];
        if (!geom || hasNaN(geom) || hasBoundedHits(geom) != (kind == bounded)) continue;
        if constexpr (sizeof(Real) > sizeof(float))
          boxes.wide_boxes[slot] = boxOfBounds<Real>(geom->aabb);
        else
          roundToFloats(geom->aabb, boxes.boxes[slot]);
      }
      of[kind].validate(boxes);
    }
  });
}

}  // namespace ode_parallel_sap
