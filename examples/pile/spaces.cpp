#include "spaces.h"

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

dSpaceID createParallel(const Options& options) {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  if (options.threads) dParallelSAPSpaceSetNumThreads(space, *options.threads);
  std::string missing;
  if (options.backend && !dParallelSAPSpaceSetBackend(space, *options.backend))
    missing = std::string("the back end ") + backendName(*options.backend);
  else if (options.method && !dParallelSAPSpaceSetMethod(space, *options.method))
    missing = std::string("the method ") + methodName(*options.method);
  if (missing.empty()) return space;
  dSpaceDestroy(space);
  throw UsageError(missing + " is not to be had here: not in this build, or not on this machine");
}

}  // namespace

dSpaceID createSpace(const Options& options) {
  switch (options.space) {
    case SpaceKind::Parallel:
      return createParallel(options);
    case SpaceKind::Hash:
      return dHashSpaceCreate(nullptr);
    case SpaceKind::SweepAndPrune:
      return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
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
