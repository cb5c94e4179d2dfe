// The geoms of a space, as a frame sees them.
#pragma once

#include <atomic>
#include <cstddef>

#include "space/base/buffer.h"
#include "space/geoms/geom_tests.h"
#include "space/geoms/reports.h"

namespace ode_parallel_sap {

struct Scene {
  dxGeom* first;                 // of the list, in the order in which geoms were added
  std::size_t count;             // of geoms
  const Buffer<dxGeom*>& slots;  // the same with gaps: null where a geom was removed
  bool nested;                   // the space is being collided already
  std::atomic<bool>& needs_clean;
  const Reports reports = {};  // of the call

  // No geom is dirty any more, for other threads too.
  void noteClean() const { needs_clean.store(false, std::memory_order_release); }
};

// How many geoms were brought up to date, and whether code of the program did it for some.
struct Cleaned {
  unsigned moved = 0;
  bool by_others = false;
};
// Brings the AABBs of all dirty geoms up to date, on this thread. Not inline: the loop needs all
// registers, and spaces in spaces little of the stack.
__attribute__((noinline)) inline Cleaned cleanOneByOne(dxGeom* first) {
  Cleaned cleaned;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if (!(geom->gflags & GEOM_DIRTY)) continue;
    ++cleaned.moved;
    cleaned.by_others = cleaned.by_others || needsCallingThread(geom);
    cleanGeom(geom);
  }
  return cleaned;
}

}  // namespace ode_parallel_sap
