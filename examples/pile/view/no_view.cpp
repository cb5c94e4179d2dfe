// In place of the viewer, in a build without one.
#include "view.h"

namespace pile {

std::unique_ptr<Viewer> createViewer(const Options&) {
  throw UsageError("--view and --snapshot are not in this build: " PILE_NO_VIEW_REASON
                   ". Install Debian's libglvnd-dev, libglu1-mesa-dev and libpng-dev, and "
                   "configure again");
}

}  // namespace pile
