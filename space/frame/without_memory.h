// The last resort where memory ends: all pairs one by one, which takes time but no memory. Sees
// ODE's private headers.
#pragma once

#include "space/frame/statistics.h"
#include "space/geoms/pack_rules.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

// Where pairs go that are found one by one.
struct PairReceiver {
  void* data;
  dNearCallback* callback;
  void (*end)(void* data);            // called after the last one; may be 0
  bool opens;                         // the callback may destroy geoms
  void (*gap)(void* data) = nullptr;  // called for a pair whose geoms have left; may be 0
};

// Counts the geoms, and brings them up to date.
dParallelSAPStats updateWithoutMemory(const Scene& scene);
// Then reports each pair as soon as it is found, and counts in `stats` meanwhile.
void collideWithoutMemory(const Scene& scene, const PackRules& rules, dParallelSAPStats& stats,
                          const PairReceiver& receiver);
// dSpaceCollide2 of the geoms of a space, which are clean, with another one.
void queryWithoutMemory(const Scene& scene, const PackRules& rules, dxGeom* geom, void* data,
                        dNearCallback* callback);

}  // namespace ode_parallel_sap
