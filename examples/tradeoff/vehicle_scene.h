#ifndef TRADEOFF_VEHICLE_SCENE_H
#define TRADEOFF_VEHICLE_SCENE_H

#include "harness.h"

namespace tradeoff {

// Vehicles of five bodies each, as many as there are bodies for, but one at least: each drives over
// bumps of its own, brakes, and stands. What matters is where it came to.
Scene vehicleScene(int bodies, double density);

}  // namespace tradeoff

#endif
