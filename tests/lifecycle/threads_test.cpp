// The number of threads changes the time, never the sequence.
#include "support/tests.h"
#include "support/together.h"

using namespace sap_test;

namespace {

// The pairs of each frame of a scene that moves, in a space of its own.
std::vector<Pairs> play(const Configuration& configuration, int threads, std::size_t n,
                        std::uint64_t seed) {
  const Space space(configuration);
  dParallelSAPSpaceSetNumThreads(space, threads);
  World world(space, denseCube(geomsOf(n) + 10 * (seed % 3), seed));
  std::vector<Pairs> frames;
  for (int frame = 0; frame < scaled(static_cast<int>(30000 / n)); ++frame) {
    world.jitter(0.3, 100 * seed + static_cast<std::uint64_t>(frame));
    frames.push_back(collide(space));
  }
  return frames;
}

}  // namespace

TEST_CASE("Spaces are created, used and destroyed by different threads at once", "[threads]") {
  const std::uint64_t seed = seedOr(43);
  for (const Configuration& configuration : configurations())
    for (const auto& [n, threads_each] : {std::pair(90, 1), {2500, 1}, {2500, 3}}) {
      const auto playOne = [&, n = static_cast<std::size_t>(n), each = threads_each](
                               std::size_t i) { return play(configuration, each, n, seed + i); };
      std::vector<std::vector<Pairs>> alone, at_once(3);
      for (std::size_t i = 0; i < 3; ++i) alone.push_back(playOne(i));
      together(3, [&](int i) { at_once[i] = playOne(i); });
      for (std::size_t i = 0; i < 3; ++i) {
        INFO(configuration.name << ", " << n << " geoms, " << threads_each
                                << " threads each, space " << i);
        for (const Pairs& frame : alone[i]) REQUIRE(!frame.empty());
        REQUIRE((at_once[i] == alone[i]));
      }
    }
}
