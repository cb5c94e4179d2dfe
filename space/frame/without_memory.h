// The last resort where memory ends: pairs of some geoms at a time. Sees ODE's private headers.
#pragma once

#include "space/frame/statistics.h"
#include "space/geoms/pair_rule.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

// Where pairs go that are reported as they are found.
struct PairReceiver {
  void* data;
  dNearCallback* callback;
  void (*end)(void* data);            // called after the last one; may be 0
  bool opens;                         // the callback may destroy geoms
  void (*gap)(void* data) = nullptr;  // called for a pair whose geoms have left; may be 0
};

// Counts the geoms, and brings them up to date.
dParallelSAPStats updateWithoutMemory(const Scene& scene);
// Then finds and reports the pairs of as many geoms at a time as the memory suffices for that is to
// be had now, and counts in `stats` meanwhile. A callback may leave in any way, so `room` is to
// hold that memory. Null: the stack does, which suffices for few.
void collideWithoutMemory(const Scene& scene, const PairRules& rules, Buffer<Pair>* room,
                          dParallelSAPStats& stats, const PairReceiver& receiver);
// dSpaceCollide2 of the geoms of a space, which are clean, with another one.
void queryWithoutMemory(const Scene& scene, const PairRules& rules, dxGeom* geom, void* data,
                        dNearCallback* callback);

}  // namespace ode_parallel_sap
