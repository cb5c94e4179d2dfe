// The geoms of a space, as a frame sees them.
#pragma once

#include <cstddef>

#include "space/base/buffer.h"
#include "space/geoms/geom_tests.h"

namespace ode_parallel_sap {

struct Scene {
  dxGeom* first;                 // of the list, in the order in which geoms were added
  std::size_t count;             // of geoms
  const Buffer<dxGeom*>& slots;  // the same with gaps: null where a geom was removed
  bool nested;                   // the space is being collided already
  bool& needs_clean;             // false once no geom is dirty
};

// Brings the AABBs of all dirty geoms up to date, on this thread. Returns their number.
inline std::size_t cleanOneByOne(dxGeom* first) {
  std::size_t moved = 0;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if (!(geom->gflags & GEOM_DIRTY)) continue;
    cleanGeom(geom);
    ++moved;
  }
  return moved;
}

}  // namespace ode_parallel_sap
