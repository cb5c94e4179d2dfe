#include "space/base/validate.h"

#include <type_traits>

#include "space/base/round_to_floats.h"
#include "space/queries/geom_tree.h"
#include "space/queries/ray_bounds.h"

namespace ode_parallel_sap {

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
