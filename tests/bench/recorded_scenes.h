// The frames of a trace as boxes, for all peers of pair-benchmark. Bodies and bits are left out:
// most peers know boxes only.
#pragma once

#include <string>
#include <vector>

#include "bench_scenes.h"

namespace bench {

// "trace": the bounding boxes of the geoms that the traced space itself has, as many as there ever
// are in a frame. A geom that is not there in a frame, is disabled or has no finite bounding box is
// set aside, where it touches nothing. Reads the file; throws trace::BadTrace.
SceneKind traceScene(const std::string& path);

// "pile-<name>" of each <name>.trace that record-piles wrote into the directory: the bodies in the
// middle of the pile if fewer boxes are asked for, copies side by side if more.
std::vector<SceneKind> pileScenes(const std::string& directory);

}  // namespace bench
