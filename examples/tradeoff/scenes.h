#ifndef TRADEOFF_SCENES_H
#define TRADEOFF_SCENES_H

#include <string>

#include "harness.h"

namespace tradeoff {

// The study's own scenes: heap, tower, hopper, vehicle, meshes. Throws std::invalid_argument where
// there is none of the name.
Scene sceneNamed(const std::string& name, int bodies);

// Bodies of 20 triangles each fall into a bowl.
Scene meshScene(int bodies);

// Vehicles of five bodies each drive over bumps for some seconds, brake and stand.
Scene vehicleScene(int bodies);

}  // namespace tradeoff

#endif
