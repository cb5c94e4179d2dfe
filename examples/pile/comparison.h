#ifndef PILE_COMPARISON_H
#define PILE_COMPARISON_H

#include "options.h"
#include "world.h"

namespace pile {

// Goes on with the pile for options.compare steps in dHashSpace, with the one line changed, and
// with parallel contacts, in this order, and prints the mean step of each.
void compareWays(World& world, const Options& options);

}  // namespace pile

#endif
