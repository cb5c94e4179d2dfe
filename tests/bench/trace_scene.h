// The frames of a trace as boxes, for all peers of pair-benchmark.
#pragma once

#include <string>
#include <vector>

#include "bench_scenes.h"

namespace bench {

// "trace", the bounding boxes of the geoms that the traced space itself has, as many as there ever
// are in a frame. What is not there in a frame, is disabled or has no finite bounding box is set
// aside, where it touches nothing. Bodies and bits are left out: most peers know boxes only. Reads
// the file; throws trace::BadTrace.
SceneKind traceScene(const std::string& path);

}  // namespace bench
