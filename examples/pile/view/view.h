#ifndef PILE_VIEW_H
#define PILE_VIEW_H

#include <functional>
#include <string>

#include "../options.h"
#include "../simulation.h"
#include "../world.h"

namespace pile {

// What is shown, and what the viewer can do with it.
struct Show {
  World& world;
  const Simulation& simulation;
  std::function<bool()> step;          // false once the run is over
  std::function<std::string()> title;  // of the window
};

// Draws a pile with drawstuff, the viewer of ODE's demos, for --view and --snapshot: steps it until
// the run is over or the window closed, and writes the picture if one was asked for. Throws
// UsageError before the first step where this build, or this machine, has nothing to draw with.
void view(const Options& options, const Show& show);

}  // namespace pile

#endif
