#ifndef PILE_COMPARISON_H
#define PILE_COMPARISON_H

#include <vector>

#include "options.h"
#include "world.h"

namespace pile {

// A way to step one pile, and milliseconds of its mean step.
struct Way {
  const char* name;
  double step;
  double broad_phase;
};

// Goes on with the pile for options.compare steps in dHashSpace, with the one line changed, and
// with parallel contacts, in this order. Empty if a signal ends it.
std::vector<Way> compareWays(World& world, const Options& options);

void printWays(const std::vector<Way>& ways, int steps);

}  // namespace pile

#endif
