#ifndef TRADEOFF_SCENES_H
#define TRADEOFF_SCENES_H

#include <string>

#include "harness.h"

namespace tradeoff {

// The study's own scenes: heap, wall, tower, hopper, vehicle, meshes. Bodies have this density, in
// kg/m^3. Throws std::invalid_argument where there is none of the name.
Scene sceneNamed(const std::string& name, int bodies, double density);

}  // namespace tradeoff

#endif
