#ifndef TRADEOFF_PILE_POINT_H
#define TRADEOFF_PILE_POINT_H

#include "row.h"

namespace tradeoff {

// Boxes of 0.6 to 1 m that fall into a pit with a floor and four walls.
struct PileSettings {
  double dt = 0.01;       // seconds
  int iterations = 20;    // of QuickStep
  int contacts = 4;       // most of a pair
  bool parallel = false;  // narrow phase and solver on all cores, or all on one
  int bodies = 200;
  double seconds = 5;         // simulated
  double rest_seconds = 1.5;  // the last of them, in which the heap counts as at rest
  unsigned long long seed = 1;
};

Row measurePile(const PileSettings& settings);

}  // namespace tradeoff

#endif
