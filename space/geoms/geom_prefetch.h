// Geoms lie scattered in memory: what will be read of them is asked for ahead.
#pragma once

#include <cstddef>

#include "space/base/platform.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// All lines of an object, which need not begin with one.
inline void prefetchObject(const void* object, std::size_t size) {
  const char* const bytes = static_cast<const char*>(object);
  for (std::size_t line = 0; line < size; line += 64) prefetch(bytes + line);
  prefetch(bytes + size - 1);
}

// The derived classes' sizes follow the base: one line more holds most of them.
inline void prefetchGeom(const dxGeom* geom) {
  prefetchObject(geom, sizeof(dxGeom) + 32);
}

// What is read of a geom whose bounds are known; and its bounds.
inline void prefetchState(const dxGeom* geom) {
  prefetch(&geom->gflags);
  prefetch(&geom->body);
  prefetch(&geom->collide_bits);
}
inline void prefetchBounds(const dxGeom* geom) {
  prefetch(&geom->gflags);
  prefetch(geom->aabb);
}

inline void prefetchPose(const dxGeom* geom) {
  if (geom->final_posr) prefetchObject(geom->final_posr, sizeof(dxPosR));
}

}  // namespace ode_parallel_sap
