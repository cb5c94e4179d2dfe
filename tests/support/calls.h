// All that reports what a space finds.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <vector>

#include "recorder.h"

namespace sap_test {

enum Call { kNear, kQuery, kBlocks, kSharedBlocks, kContacts, kOverlaps, kRays, kCalls };

// The geom of a query, and as many probes and rays as are asked about at once.
struct Asked {
  dGeomID geom = nullptr;
  dParallelSAPRay ray = {};
  std::size_t count = 1;
  dGeomID last = nullptr;  // the last probe, if it is another one
};

// Has a space report to a function object, which takes what any callback gets. It may be left by
// longjmp.
template <class Function>
void report(Call call, dSpaceID space, const Asked& asked, Function& function) {
  static std::vector<dParallelSAPProbe> probes;
  static std::vector<dParallelSAPRay> rays;
  const dParallelSAPContactCallbacks contacts = {invoke<Function>, nullptr, nullptr, nullptr};
  switch (call) {
    case kNear:
      return dSpaceCollide(space, &function, invoke<Function>);
    case kQuery:
      return dSpaceCollide2(asGeom(space), asked.geom, &function, invoke<Function>);
    case kContacts:
      return dParallelSAPSpaceCollideContacts(space, &function, 1, &contacts);
    case kOverlaps:
      probes.assign(asked.count, {asked.geom, nullptr, 0});
      if (asked.last) probes.back().geom = asked.last;
      dParallelSAPSpaceOverlaps(space, probes.data(), asked.count, sizeof probes[0], 1, &function,
                                invoke<Function>);
      return;
    case kRays:
      rays.assign(asked.count, asked.ray);
      dParallelSAPSpaceRayHits(space, rays.data(), asked.count, 1, &function, invoke<Function>);
      return;
    default:
      dParallelSAPSpaceCollidePairs(
          space, &function, call == kBlocks ? 0 : dParallelSAPPairsConcurrent, invoke<Function>);
  }
}

}  // namespace sap_test
