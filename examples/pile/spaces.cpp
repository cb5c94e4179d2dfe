#include "spaces.h"

#include <algorithm>
#include <cmath>

namespace pile {
namespace {

const char* methodName(int method) {
  switch (method) {
    case dParallelSAPMethodSweep:
      return "sweep";
    case dParallelSAPMethodBruteForce:
      return "brute-force";
    case dParallelSAPMethodAxisLists:
      return "axis-lists";
    default:
      return "auto";
  }
}

const char* backendName(int backend) {
  switch (backend) {
    case dParallelSAPBackendCPU:
      return "cpu";
    case dParallelSAPBackendCUDA:
      return "cuda";
    default:
      return "auto";
  }
}

// What is not asked for is left to the environment.
void setRules(dSpaceID space, const Rules& rules) {
  if (rules.tolerance > 0)
    dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(rules.tolerance));
  if (rules.skip_static) dParallelSAPSpaceSetSkipStatic(space, 1);
  if (rules.skip_asleep) dParallelSAPSpaceSetSkipAsleep(space, 1);
  if (rules.cull_planes) dParallelSAPSpaceSetCullPlanes(space, 1);
}

dSpaceID createParallel(const Options& options) {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  if (options.threads) dParallelSAPSpaceSetNumThreads(space, *options.threads);
  setRules(space, options.rules);
  std::string missing;
  if (options.backend && !dParallelSAPSpaceSetBackend(space, *options.backend))
    missing = std::string("the back end ") + backendName(*options.backend);
  else if (options.method && !dParallelSAPSpaceSetMethod(space, *options.method))
    missing = std::string("the method ") + methodName(*options.method);
  if (missing.empty()) return space;
  dSpaceDestroy(space);
  throw UsageError(missing + " is not to be had here: not in this build, or not on this machine");
}

dSpaceID createQuadTree(const std::vector<dGeomID>& geoms) {
  dVector3 low = {0, 0, 0};
  dVector3 high = {0, 0, 0};
  for (dGeomID geom : geoms) {
    dReal box[6];
    dGeomGetAABB(geom, box);
    for (int i = 0; i < 3; ++i) {
      if (std::isfinite(box[2 * i])) low[i] = std::min(low[i], box[2 * i]);
      if (std::isfinite(box[2 * i + 1])) high[i] = std::max(high[i], box[2 * i + 1]);
    }
  }
  dVector3 centre = {0, 0, 0};
  dVector3 extents = {0, 0, 0};
  for (int i = 0; i < 3; ++i) {
    centre[i] = (low[i] + high[i]) / 2;
    extents[i] = high[i] - low[i];
  }
  constexpr int depth = 6;  // 64 x 64 leaves
  return dQuadTreeSpaceCreate(nullptr, centre, extents, depth);
}

}  // namespace

dSpaceID createSpace(const Options& options, const std::vector<dGeomID>& geoms) {
  switch (options.space) {
    case SpaceKind::Parallel:
      return createParallel(options);
    case SpaceKind::Hash:
      return dHashSpaceCreate(nullptr);
    case SpaceKind::SweepAndPrune:
      return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
    case SpaceKind::QuadTree:
      return createQuadTree(geoms);
    case SpaceKind::Simple:
      break;
  }
  return dSimpleSpaceCreate(nullptr);
}

std::string describeSpace(dSpaceID space) {
  if (!dSpaceIsParallelSAP(space)) {
    switch (dGeomGetClass(reinterpret_cast<dGeomID>(space))) {
      case dHashSpaceClass:
        return "dHashSpace";
      case dSweepAndPruneSpaceClass:
        return "dSweepAndPruneSpace";
      case dQuadTreeSpaceClass:
        return "dQuadTreeSpace";
      default:
        return "dSimpleSpace";
    }
  }
  dParallelSAPStats stats;
  dParallelSAPSpaceGetStats(space, &stats);
  return std::string("dParallelSAPSpace (") + methodName(stats.method) + ", " +
         backendName(stats.backend) + ")";
}

}  // namespace pile
