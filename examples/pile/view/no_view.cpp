// In place of the viewer, in a build without one.
#include "view.h"

namespace pile {

void view(const Options&, const Show&) {
  throw UsageError("--view and --snapshot are not in this build: " PILE_NO_VIEW_REASON
                   ". Install Debian's libglvnd-dev, libglu1-mesa-dev and libpng-dev, and "
                   "configure again");
}

}  // namespace pile
