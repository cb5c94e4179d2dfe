// Collides whose callback does nothing but count.
#pragma once

#include <ode/ode.h>

#include <cstddef>

#include "stopwatch.h"

namespace bench {

// A dNearCallback; `pairs` points to a std::size_t.
inline void countPair(void* pairs, dGeomID, dGeomID) {
  ++*static_cast<std::size_t*>(pairs);
}

// Milliseconds of a dSpaceCollide, and the number of its pairs.
inline double timeCollide(dSpaceID space, std::size_t& pairs) {
  pairs = 0;
  const Stopwatch clock;
  dSpaceCollide(space, &pairs, countPair);
  return clock.milliseconds();
}

}  // namespace bench
