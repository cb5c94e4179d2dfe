// Boxes of few kinds of filter bits, of which many do not meet.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

struct Kind {
  unsigned long category, collide;
};
struct Kinds {
  const char* name;
  std::vector<Kind> all;
};

// The first in a list are the most common.
const std::vector<Kinds>& kindsOfBits() {
  constexpr unsigned long high = 1ul << (5 * sizeof(long));  // 20 where there are only 32
  static const std::vector<Kinds> all = {
      {"two that meet each other only", {{1, 2}, {2, 1}}},
      {"one that meets itself and one that meets the other", {{1, 3}, {2, 1}}},
      {"one that meets nothing", {{1, 0}, {2, 2}}},
      {"three of which each meets the next one", {{1, 2}, {2, 4}, {4, 8}}},
      {"four", {{1, 6}, {2, 8}, {4, 8}, {8, 8}}},
      {"five", {{1, 2}, {2, 4}, {4, 8}, {8, 16}, {16, 1}}},
      {"bits beyond 32", {{high, high << 1}, {high << 1, high}}},
  };
  return all;
}

void setBits(dGeomID geom, const Kinds& kinds, Random& random) {
  std::size_t kind = random.below(kinds.all.size());
  if (random.chance(0.5)) kind = random.below(kind + 1);
  dGeomSetCategoryBits(geom, kinds.all[kind].category);
  dGeomSetCollideBits(geom, kinds.all[kind].collide);
}

// One frame after the other: nothing but places changes, then bits of some, then all of them are of
// other kinds, which a space is not told.
void play(const Kinds& kinds, const WorldScene& scene, int threads, std::uint64_t seed) {
  const Space space({dParallelSAPBackendCPU, dParallelSAPMethodSweep, "cpu, sweep"});
  dParallelSAPSpaceSetNumThreads(space, threads);
  World world(space);
  scene.populate(world, 500, seed);
  Random random(seed);
  for (const dGeomID geom : world.geoms()) setBits(geom, kinds, random);
  for (std::uint64_t frame = 0; frame < 6; ++frame) {
    if (frame) world.jitter(0.2, seed + frame);
    if (frame == 2)
      for (int i = 0; i < 30; ++i)
        setBits(world.geoms()[random.below(world.geoms().size())], kinds, random);
    if (frame == 4)
      for (const dGeomID geom : world.geoms())
        setBits(geom, kindsOfBits()[random.below(kindsOfBits().size())], random);
    INFO(kinds.name << ", " << scene.name << ", " << threads << " threads, frame " << frame
                    << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    const Pairs got = collide(space);
    REQUIRE(difference(got, expectedPairs(world.geoms())) == "");
  }
}

}  // namespace

TEST_CASE("Whatever kinds of bits there are, all pairs are reported in their order", "[groups]") {
  const std::uint64_t seed = seedOr(71);
  for (const Kinds& kinds : kindsOfBits())
    for (const WorldScene& scene : worldScenes()) {
      if (scene.most < 500) continue;
      for (const int threads : {1, 3}) play(kinds, scene, threads, seed);
    }
}

// What most boxes of a cell have in common is not what all have.
TEST_CASE("One geom whose bits are unlike all others' keeps its pairs and gets no others",
          "[groups]") {
  for (const bool meets_all : {false, true}) {
    const Space space({dParallelSAPBackendCPU, dParallelSAPMethodSweep, "cpu, sweep"});
    World world(space);
    world.addBoxes(denseCube(301, 5));
    for (std::size_t i = 0; i < world.geoms().size(); ++i) {
      const bool as_wished = (i == 0) == meets_all;
      dGeomSetCategoryBits(world.geoms()[i], as_wished ? ~0ul : 1);
      dGeomSetCollideBits(world.geoms()[i], as_wished ? ~0ul : 0);
    }
    REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
  }
}
