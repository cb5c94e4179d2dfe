#include "comparison.h"

#include <cstdio>

#include "report.h"
#include "simulation.h"
#include "spaces.h"

namespace pile {

void compareWays(World& world, const Options& given) {
  std::printf("\nThe same pile, %s more\n  %-24s %10s  %14s  %s\n",
              counted(given.compare, "step").c_str(), "space", "ms a step", "broad phase",
              "step, times faster than dHashSpace");
  double first = 0;
  const auto run = [&](const char* name, SpaceKind kind, bool parallel_narrow) {
    Options options = given;
    options.space = kind;
    options.parallel_narrow = parallel_narrow;
    options.check = false;
    world.useSpace(createSpace(options));
    Simulation simulation(world, options);
    Totals totals;
    simulation.step();  // which takes all geoms in
    for (int i = 0; i < options.compare; ++i) totals.add(simulation.step());
    const double step = totals.totalMs() / totals.frames;
    if (first == 0) first = step;
    std::printf("  %-24s %10.3f  %14.3f  %.2f\n", name, step, totals.broad_ms / totals.frames,
                first / step);
  };
  run("dHashSpace", SpaceKind::Hash, false);
  run("the one line changed", SpaceKind::Parallel, false);
  run("parallel contacts", SpaceKind::Parallel, true);
}

}  // namespace pile
