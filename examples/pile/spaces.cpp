#include "spaces.h"

namespace pile {
namespace {

std::string nameIn(const Names& names, int number) {
  for (const auto& name : names)
    if (name.second == number) return name.first;
  return "?";
}

dSpaceID createParallel(const Options& options) {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  if (options.threads) dParallelSAPSpaceSetNumThreads(space, *options.threads);
  std::string missing;
  if (options.backend && !dParallelSAPSpaceSetBackend(space, *options.backend))
    missing = "the back end " + nameIn(backend_names, *options.backend);
  else if (options.method && !dParallelSAPSpaceSetMethod(space, *options.method))
    missing = "the method " + nameIn(method_names, *options.method);
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
  return "dParallelSAPSpace (" + nameIn(method_names, stats.method) + ", " +
         nameIn(backend_names, stats.backend) + ")";
}

}  // namespace pile
