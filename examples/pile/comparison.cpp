#include "comparison.h"

#include <cstdio>

#include "interrupt.h"
#include "report.h"
#include "simulation.h"
#include "spaces.h"

namespace pile {

std::vector<Way> compareWays(World& world, const Options& given) {
  std::vector<Way> ways;
  const auto add = [&](const char* name, SpaceKind kind, bool parallel_narrow) {
    Options options = given;
    options.space = kind;
    options.parallel_narrow = parallel_narrow;
    options.check = false;
    world.useSpace(createSpace(options, world.geoms()));
    Simulation simulation(world, options);
    Totals totals;
    simulation.step();  // which takes all geoms in
    for (int i = 0; i < options.compare && !Interrupt::signal(); ++i) totals.add(simulation.step());
    if (totals.frames == options.compare)
      ways.push_back({name, totals.totalMs() / totals.frames, totals.broad_ms / totals.frames});
  };
  add("dHashSpace", SpaceKind::Hash, false);
  add("the one line changed", SpaceKind::Parallel, false);
  add("parallel contacts", SpaceKind::Parallel, true);
  if (ways.size() < 3) ways.clear();
  return ways;
}

void printWays(const std::vector<Way>& ways, int steps) {
  if (ways.empty()) return;
  std::printf("\nThe same pile, %s more\n  %-24s %10s  %14s  %s\n", counted(steps, "step").c_str(),
              "space", "ms a step", "broad phase", "step, times faster than dHashSpace");
  for (const Way& way : ways)
    std::printf("  %-24s %10.3f  %14.3f  %.2f\n", way.name, way.step, way.broad_phase,
                ways.front().step / way.step);
}

}  // namespace pile
