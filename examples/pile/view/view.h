#ifndef PILE_VIEW_H
#define PILE_VIEW_H

#include <functional>
#include <memory>
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

// Draws a pile with drawstuff, the viewer of ODE's demos. One Viewer lives at a time.
class Viewer {
 public:
  virtual ~Viewer() = default;

  // Steps the pile until the run is over or the window closed, and writes the picture if one was
  // asked for.
  virtual void run(const Show& show) = 0;
};

// The viewer for --view and --snapshot. Throws UsageError where this build, or this machine, has
// nothing to draw with, so that nobody waits for a picture that cannot come.
std::unique_ptr<Viewer> createViewer(const Options& options);

}  // namespace pile

#endif
