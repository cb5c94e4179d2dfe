#ifndef PILE_CAMERA_H
#define PILE_CAMERA_H

#include <array>

#include "../world.h"

namespace pile {

// Where one stands and looks, in metres of the world and degrees, as drawstuff counts them: heading
// from the x axis, pitch upwards.
struct Camera {
  std::array<double, 3> position;
  double heading;
  double pitch;
};

// A camera that looks at the middle of the bodies as they are now, from far enough to see most of
// them, but not so far that a single one becomes too small to be made out.
Camera cameraFor(const World& world);

}  // namespace pile

#endif
