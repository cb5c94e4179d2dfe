#ifndef TRADEOFF_MESH_SCENE_H
#define TRADEOFF_MESH_SCENE_H

#include "harness.h"

namespace tradeoff {

// So many pebbles fall into a bowl, everything of triangles.
Scene meshScene(int bodies, double density);

}  // namespace tradeoff

#endif
