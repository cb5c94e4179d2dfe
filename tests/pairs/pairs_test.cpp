// dSpaceCollide reports the pairs it owes, each once and in order, whatever the scene, the method
// and the back end.
#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

// Around the widths of vectors, chunks and small-scene shortcuts.
constexpr std::size_t kSizes[] = {0,   1,   2,   3,   4,   5,   7,   8,    9,    15,   16,  17,
                                  31,  32,  33,  63,  64,  65,  100, 127,  128,  129,  255, 256,
                                  257, 300, 400, 511, 512, 513, 700, 1023, 1024, 1025, 5000};

}  // namespace

TEST_CASE("Every scene of any size gives the pairs owed, on any threads, at first and after moves",
          "[pairs]") {
  const std::size_t most = static_cast<std::size_t>(std::max(300, scaled(5000)));
  std::size_t run = 0;
  for (const Configuration& configuration : configurations())
    for (const WorldScene& scene : worldScenes())
      for (const std::size_t n : kSizes) {
        if (n > std::min(scene.most, geomsOf(n)) || n > most) continue;
        const std::uint64_t seed = seedOr(30 + n);
        const int threads[] = {1, 2, 3, 7, 16};
        const Space space(configuration);
        dParallelSAPSpaceSetNumThreads(space, threads[run++ % std::size(threads)]);
        World world(space);
        scene.populate(world, n, seed);
        INFO(configuration.name << ", " << scene.name << ", " << n << " geoms, "
                                << dParallelSAPSpaceGetNumThreads(space)
                                << " threads, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        for (std::uint64_t frame = 0; frame < (n > 700 ? 1 : 3); ++frame) {
          CAPTURE(frame);
          REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
          REQUIRE(statsOf(space).threads <= dParallelSAPSpaceGetNumThreads(space));
          world.jitter(0.3, seed + frame);
          if (frame == 1 && n >= 128) world.shrinkTo(n / 128 * 64);  // whole words of slots leave
        }
      }
}

TEST_CASE("Twenty thousand geoms give the same pairs whatever the method", "[pairs][long]") {
  // Too many for the oracle: against each other, one of them being brute force.
  const std::uint64_t seed = seedOr(31);
  const std::size_t n = static_cast<std::size_t>(scaled(20000));
  for (const Boxes& boxes : {sixDecades(n, seed), farClusters(n, seed), longBars(n, seed)}) {
    Pairs first;
    for (const Configuration& configuration : configurations()) {
      if (configuration.method == dParallelSAPMethodAxisLists) continue;  // memory
      const Space space(configuration);
      World world(space, boxes);
      const Pairs pairs = collide(space);
      if (first.empty()) first = pairs;
      INFO(configuration.name << " against " << configurations()[0].name);
      REQUIRE(difference(pairs, first) == "");
      REQUIRE(!first.empty());
    }
  }
}

TEST_CASE("One step of dReal apart is no pair, on any axis and at any place", "[pairs]") {
  using Limits = std::numeric_limits<dReal>;
  const double places[] = {0,
                           double(Limits::denorm_min()),
                           1e-320,
                           1e-310,
                           1e-50,
                           1e-20,
                           1,
                           1e6,
                           12345.678,
                           1e30,
                           1e39,
                           1e300,
                           double(Limits::max() / 2)};
  for (const Configuration& configuration : configurations())
    for (const double place : places)
      for (int i = 0; i < 6 && place <= double(Limits::max()); ++i) {
        const dReal at = real(i % 2 ? -place : place);
        const dReal apart = std::nextafter(at, Limits::max()),
                    side = std::max(std::abs(at), dReal(1));
        const std::size_t axis = static_cast<std::size_t>(i / 2);
        Bounds below = {-1, 1, -1, 1, -1, 1}, touching = below, above = below;
        below[2 * axis] = at - side;
        below[2 * axis + 1] = touching[2 * axis] = at;
        above[2 * axis] = apart;
        touching[2 * axis + 1] = above[2 * axis + 1] = at + side;
        const Space space(configuration);
        World world(space);
        for (const Bounds& bounds : {below, touching, above})
          world.take(createUserBox(space, bounds));
        INFO(configuration.name << ", axis " << axis << " at " << at);
        CHECK(difference(collide(space), {{0, 1}, {1, 2}}) == "");
        // The same among many others, so that no small-scene shortcut answers.
        world.addBoxes(denseCube(600, 1));
        CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
      }
}
