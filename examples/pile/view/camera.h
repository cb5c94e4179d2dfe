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

// How far drawstuff sees to each side of its line of sight, in a picture of this shape: the
// tangents of the half angles.
constexpr double camera_opening = 0.8;
constexpr double picture_shape = 3.0 / 4;  // height to width
constexpr double camera_opening_up = camera_opening * picture_shape;

// A camera whose picture has all bodies as they are now and the ground below them, or all of a
// ground that holds them. Bodies far away from all others do not count, and where a body would
// become too small to be seen, the outer ones are left out.
Camera cameraFor(const World& world);

}  // namespace pile

#endif
