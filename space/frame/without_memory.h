// The last resort where memory ends: all pairs one by one, which takes time but no memory. Sees
// ODE's private headers.
#pragma once

#include "space/frame/frame_result.h"
#include "space/geom/pack_rules.h"
#include "space/geom/scene.h"

namespace ode_parallel_sap {

// Counts the geoms, and brings them up to date.
void updateWithoutMemory(const Scene& scene, FrameResult& result);
// Then reports each pair as soon as it is found, and counts in `result` meanwhile.
void collideWithoutMemory(const Scene& scene, const PackRules& rules, FrameResult& result,
                          void* data, dNearCallback* callback);
// dSpaceCollide2 of the geoms of a space, which are clean, with another one.
void queryWithoutMemory(const Scene& scene, const PackRules& rules, dxGeom* geom, void* data,
                        dNearCallback* callback);

}  // namespace ode_parallel_sap
