#ifndef TRADEOFF_BROAD_POINT_H
#define TRADEOFF_BROAD_POINT_H

#include <string>

#include "row.h"

namespace tradeoff {

// Boxes of half a metre to one and a half, in a cube so dense that there are about four pairs a
// box, all moving.
struct BroadSettings {
  std::string space = "parallel";  // or "hash", "sap"
  std::string backend = "cpu";     // or "cuda"; of the parallel space
  int threads = 0;                 // 0: as OpenMP would
  double tolerance = 0;            // metres; of the parallel space
  double offset = 0;               // of the whole scene from the origin, metres along each axis
  double step = 0.01;              // most that a box moves in a frame along each axis, metres
  int boxes = 10000;
  int frames = 20;
  unsigned long long seed = 1;
};

// Measures the time of dSpaceCollide, and compares the last frame's pairs with two references, both
// found by a search of this program's own: the pairs of the boxes as they were meant, in double
// precision at the origin, and those of the boxes as ODE stores them. Throws std::runtime_error
// where the space or back end is not to be had.
Row measureBroadPhase(const BroadSettings& settings);

}  // namespace tradeoff

#endif
