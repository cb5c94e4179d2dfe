// What a space keeps from frame to frame must not show, and is kept where it pays. Random calls
// (fuzz) hold the pairs of all kinds of frames against the rules.
#include <set>

#include "support/contact_scene.h"
#include "support/rules_oracle.h"
#include "support/tests.h"
#include "support/user_box.h"
#include "support/variable.h"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

using namespace sap_test;

namespace {

constexpr double kSlow = 0.001;  // of a width in a frame: little for the thin bars, too

}  // namespace

TEST_CASE("Whatever a frame keeps, statistics count the geoms that moved and the pairs it found",
          "[motions]") {
  const unsigned long high = 1ul << (8 * sizeof(unsigned long) - 2);
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {12, 100, 400, 2000})
      for (const bool planes : {false, true}) {
        const std::uint64_t seed = seedOr(n);
        const Space space(configuration);
        World world(space);
        if (planes) world.take(dCreatePlane(space, 0, 0, 1, 2));
        world.addBoxes(denseCube(n, seed));
        if (planes) world.take(dCreatePlane(space, 1, 0, 0, 1));
        dParallelSAPSpaceSetCullPlanes(space, planes);
        const std::vector<dGeomID>& geoms = world.geoms();
        Random random(seed);
        std::size_t kept = 0, contacts = 0;
        for (int frame = 0; frame < 36; ++frame) {
          std::set<dGeomID> moved;
          if (frame == 0) moved.insert(geoms.begin(), geoms.end());
          // None, one, a few or all, by little or far; some get bits as none had before.
          const double part[] = {0, 0, 0.03, 1};
          for (const dGeomID geom : geoms) {
            if (!random.chance(part[frame % 4])) continue;
            if (dGeomGetClass(geom) == dPlaneClass) {
              dGeomPlaneSetParams(geom, 0, 0, 1, real(random.between(1, 3)));
            } else {
              moveBy(geom, 0, 0, frame % 8 == 3 ? 0.001 : 0.3);
            }
            moved.insert(geom);
          }
          if (frame % 6 == 5) {
            dGeomSetCategoryBits(geoms[random.below(geoms.size())], high | 1ul << random.below(3));
            dGeomSetPosition(geoms[5], 1, 1, 1);
            moved.insert(geoms[5]);
          }
          if (frame % 12 == 7) {
            const dGeomID gone = geoms[7];
            world.remove(gone);
            dGeomDestroy(gone);
            moved.erase(gone);
          }
          INFO(configuration.name << ", " << n << " geoms, planes " << planes << ", frame " << frame
                                  << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
          Pairs pairs;
          std::size_t touching = 0;
          if (frame % 3 == 2) pairs = collide(space);
          if (frame % 3 == 1) dParallelSAPSpaceCollidePairs(space, nullptr, 0, nullptr);
          if (frame % 3 == 0) touching = parallelContacts(space, 4).size();
          const dParallelSAPStats stats = statsOf(space);
          REQUIRE(wrongCounts(space, geoms, frame % 3 == 2 ? pairs.size() : stats.pairs) == "");
          REQUIRE(stats.moved == moved.size());
          REQUIRE(stats.contacts == touching);
          // Those of two geoms that stayed where they were, at most.
          std::set<std::size_t> left;
          for (const dGeomID geom : moved) left.insert(number(geom));
          if (frame % 3 == 2)
            REQUIRE(stats.kept <= static_cast<std::size_t>(std::count_if(
                                      pairs.begin(), pairs.end(), [&](const Pair& pair) {
                                        return !left.count(pair.first) && !left.count(pair.second);
                                      })));
          REQUIRE(stats.frames == static_cast<unsigned>(frame) + 1);
          const auto runs = [](int what, int asked, int automatic) {
            return asked == automatic ? what != automatic : what == asked;
          };
          const bool on_cpu_alone = configuration.method == dParallelSAPMethodBruteForce;
          REQUIRE(runs(stats.backend, on_cpu_alone ? dParallelSAPBackendCPU : configuration.backend,
                       dParallelSAPBackendAuto));
          REQUIRE((runs(stats.method, configuration.method, dParallelSAPMethodAuto) || stats.kept));
          REQUIRE(stats.threads >= 1);
          // The stages are parts of the whole; clocks may tick in between.
          REQUIRE(stats.update_ms + stats.synchronise_ms + stats.extract_ms + stats.filter_ms +
                      stats.report_ms <=
                  stats.total_ms * 1.001 + 0.001);
          if (stats.kept == 0 && stats.method == dParallelSAPMethodBruteForce && n <= 100)
            REQUIRE(stats.candidates == stats.pairs);
          kept += stats.kept > 0;
          contacts += touching;
        }
        if (n > 120 && configuration.backend != dParallelSAPBackendCUDA &&
            configuration.method <= dParallelSAPMethodSweep)
          CHECK(kept > 0);
        CHECK(contacts > 0);
      }
}

TEST_CASE("The last geom is counted no more once it has gone", "[motions]") {
  const Space space;
  World world(space, denseCube(400, 5));
  dGeomDisable(world.geoms().back());
  (void)collide(space);
  CHECK(statsOf(space).disabled == 1);
  world.shrinkTo(399);
  (void)collide(space);
  CHECK(statsOf(space).disabled == 0);
}

TEST_CASE("A tolerance lets no pair through that is further apart, whatever the scale",
          "[motions]") {
  const double scales[] = {1e-38, 1e-30, 1, 1e30, 1e36, 3e37, 1e38, 1e39, 1e60, 1e100, 1e300};
  for (const double scale : scales)
    for (const double tolerance : {0.01, 0.3, 100.0, 1e7})
      for (const int small : {12, 60})
        for (const double outlier : {0.0, 1e38, double(std::numeric_limits<dReal>::max())}) {
          if (!std::isfinite(real(100 * scale)) || !std::isfinite(real(tolerance * scale)))
            continue;
          const Space space(on_cpu);
          World world(space);
          Random random(seedOr(71));
          // Most overlap each other. The small ones lie between and beside them, on both sides.
          for (int i = 0; i < 160; ++i) world.take(dCreateSphere(space, real(3 * scale)));
          for (int i = 0; i < small; ++i) {
            const dGeomID geom = world.take(dCreateSphere(space, real(0.1 * scale)));
            const double side = random.chance(0.5) ? 1 : -1, at = side * random.between(0, 5);
            dGeomSetPosition(geom, real(at * scale), real(random.below(2) * scale), 0);
          }
          if (outlier > 0) dGeomSetPosition(world.geoms()[7], real(outlier), 0, 0);
          dParallelSAPSpaceSetTolerance(space, real(tolerance * scale));
          for (int frame = 0; frame < 4; ++frame) {
            // By so little that fat boxes stay, which are farther and farther from their geoms.
            for (const dGeomID geom : world.geoms())
              if (frame > 0 && tolerance < 1)
                dGeomSphereSetRadius(geom,
                                     dGeomSphereGetRadius(geom) - real(0.11 * tolerance * scale));
            INFO("scale " << scale << ", tolerance " << tolerance << " of it, " << small
                          << " small ones, outlier " << outlier << ", frame " << frame);
            const Pairs pairs = collide(space);
            REQUIRE(wrongByRules(Rules::of(space), world.geoms(), pairs) == "");
          }
        }
}

TEST_CASE("Nor does one below the steps of denormals", "[motions]") {
  const double step = std::numeric_limits<float>::denorm_min();
  for (const double tolerance : {0.7, 0.85, 20.0, 40.0}) {
    const Space space(on_cpu);
    World world(space);
    for (int i = 0; i < 300; ++i) {
      const double at = (i % 2) * (40.7 + i / 2 % 5 * 0.06) + i / 2 % 11 * 0.13;
      const dReal width = real(40 * step);
      const dGeomID geom = world.take(dCreateBox(space, width, width, width));
      dGeomSetPosition(geom, real(at * step), real(i / 2 * 90 * step), 0);
    }
    dParallelSAPSpaceSetTolerance(space, real(tolerance * step));
    INFO("tolerance " << tolerance << " steps");
    REQUIRE(wrongByRules(Rules::of(space), world.geoms(), collide(space)) == "");
  }
}

TEST_CASE("Candidates are kept where all trembles, and given back after", "[motions]") {
  const Space space(on_cpu);
  World world(space, denseCube(1500, 122));
  const auto frames = [&](int count, double distance) {
    std::size_t kept = 0;
    for (int frame = 0; frame < count; ++frame) {
      if (distance > 0) world.jitter(distance, 1000 * distance + frame);
      const Pairs pairs = collide(space);
      const std::size_t candidates = statsOf(space).candidates_kept;
      if (candidates > 0) CHECK(candidates < 2 * pairs.size());
      kept += candidates >= pairs.size() * 9 / 10;
    }
    return kept;
  };
  CHECK(frames(40, 0.4) == 0);
  CHECK(frames(40, kSlow) > 30);
  (void)frames(20, 0);
  const std::size_t held = statsOf(space).memory_bytes;
  (void)frames(80, 0);
  CHECK(statsOf(space).memory_bytes + 36 * 1500 < held);
  CHECK(frames(10, kSlow) > 5);
}

TEST_CASE(
    "Candidates are kept where all swings within an eighth, stays or moves together, not where "
    "each goes on",
    "[motions]") {
  struct Motion {
    double swing, together, apart;  // of each to its own side, of all, of each in its own direction
    int still_frames;               // between jumps
    int least, most;                // frames with kept candidates
  };
  for (const Motion& motion : {Motion{0, 0, 0, 0, 98, 98},  // all that ODE calls moved
                               {0.1, 0, 0, 0, 80, 100},
                               {0.15, 0, 0, 0, 0, 0},
                               {0.1, 0, 0.02, 0, 0, 0},
                               {0, 0, 0.02, 0, 0, 0},
                               {0, 0.02, 0, 0, 97, 98},
                               {0.1, 5, 0, 0, 80, 100},
                               {0.15, 5, 0, 0, 0, 0},
                               {0.004, 0, 0, 6, 55, 90}}) {
    const Space space(on_cpu);
    World world(space, denseCube(1500, 124));
    int kept = 0;
    for (int frame = 0; frame < 100; ++frame) {
      const bool jumps = motion.still_frames && frame % motion.still_frames == 0;
      for (const dGeomID geom : world.geoms()) {
        const bool odd = number(geom) % 2 == 1;
        const double apart = jumps ? 0.3 : motion.apart;
        moveBy(geom, frame % 2 == odd ? motion.swing : -motion.swing,
               motion.together + (odd ? apart : -apart), 0);
      }
      const Pairs pairs = collide(space);
      if (frame % 25 == 24) CHECK(pairs == expectedPairs(world.geoms()));
      kept += statsOf(space).candidates_kept > 0;
    }
    INFO("swing " << motion.swing << ", together " << motion.together << ", apart " << motion.apart
                  << ", jumps after " << motion.still_frames);
    CHECK(kept >= motion.least);
    CHECK(kept <= motion.most);
    dParallelSAPSpaceSetTolerance(space, real(0.1));  // which no move before has a part in
    for (int frame = 0; frame < 4; ++frame) {
      world.jitter(0, 1);
      (void)collide(space);
    }
    CHECK(statsOf(space).candidates_kept > 0);
  }
}

TEST_CASE("Swings beyond a tolerance let no near pair through", "[motions]") {
  const Space space(on_cpu);
  World world(space);
  for (int i = 0; i < 1000; ++i)
    dGeomSetPosition(world.take(dCreateBox(space, 1, 1, 1)), real(1.1 * (i % 10)),
                     real(1.1 * (i / 10 % 10)), real(1.1 * (i / 100)));
  dParallelSAPSpaceSetTolerance(space, real(0.4));
  for (int frame = 0; frame < 30; ++frame) {
    for (const dGeomID geom : world.geoms()) moveBy(geom, frame % 2 ? 0.1 : -0.1, 0, 0);
    INFO("frame " << frame);
    CHECK(collide(space).empty() == (frame > 0));
  }
}

TEST_CASE(
    "With a tolerance near pairs are let through, the same on any number of threads, by Auto and "
    "Sweep, told of changes or not, without a report, and whatever was in memory",
    "[motions]") {
  const BareEnvironment bare;
  // What the heap gives is not all 0.
  const auto fillMemory = [](int with) {
#if defined(__GLIBC__)
    mallopt(M_PERTURB, with);
#else
    (void)with;
#endif
  };
  for (const std::size_t n : {160, 3000}) {
    Space spaces[3];
    for (const Space& space : spaces) dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
    World one(spaces[0]), two(spaces[1]), silent(spaces[2]);
    World* const worlds[] = {&one, &two, &silent};
    for (int i = 0; i < 3; ++i) {
      worlds[i]->addBoxes(denseCube(n, 67));
      if (i == 1) dParallelSAPSpaceSetMethod(spaces[i], dParallelSAPMethodSweep);
      for (const int geom : {0, 2}) {  // so that bits decide
        dGeomSetCategoryBits(worlds[i]->geoms()[geom], 1 + geom);
        dGeomSetCollideBits(worlds[i]->geoms()[geom], 4);
      }
      for (std::size_t geom = 1; geom < n; geom += 4) dGeomDisable(worlds[i]->geoms()[geom]);
      dParallelSAPSpaceSetTolerance(spaces[i], 0.1);
      dParallelSAPSpaceSetNumThreads(spaces[i], i + 1);
    }
    dParallelSAPSpaceSetNotified(spaces[2], 1);
    for (int frame = 0; frame < 80; ++frame) {
      INFO(n << " geoms, frame " << frame);
      // Further than the tolerance, then within it, then not at all.
      for (World* const world : worlds) {
        if (frame >= 30 && frame < 60) world->addBoxes(denseCube(40, 68 + frame));
        if (frame < 60) world->jitter(frame < 20 ? 0.5 : 0.0005, frame);
      }
      fillMemory(0x55);
      const Pairs pairs = collide(spaces[0]);
      fillMemory(0x80 | frame);
      REQUIRE(pairs == collide(spaces[1]));
      dParallelSAPSpaceCollidePairs(spaces[2], nullptr, 0, nullptr);
      fillMemory(0);
      REQUIRE(statsOf(spaces[2]).pairs == pairs.size());
      if (frame == 79) CHECK(pairs.size() > expectedPairs(one.geoms()).size());
    }
  }
}

TEST_CASE("Auto and Sweep have the same extra pairs when a tolerance comes and goes", "[motions]") {
  for (const std::size_t n : {210, 300, 450, 520}) {
    const Space by_auto(on_cpu), by_sweep(on_cpu);
    dParallelSAPSpaceSetMethod(by_sweep, dParallelSAPMethodSweep);
    World one(by_auto), other(by_sweep);
    for (World* const world : {&one, &other}) world->addBoxes(onePlace(n, 75));
    std::size_t by_brute_force = 0, extra = 0;
    for (int frame = 0; frame < 200; ++frame) {
      INFO(n << " geoms, frame " << frame);
      for (World* const world : {&one, &other}) {
        dParallelSAPSpaceSetTolerance(world->space(), frame / 7 % 2 ? 0.1 : 0);
        world->jitter(frame % 20 < 3 ? 0.3 : 0.002, 76 + frame);
      }
      const Pairs pairs = collide(by_auto);
      REQUIRE(pairs == collide(by_sweep));
      by_brute_force += statsOf(by_auto).method == dParallelSAPMethodBruteForce;
      extra += pairs.size() - expectedPairs(one.geoms()).size();
    }
    CHECK(extra > 0);
    CHECK((by_brute_force > 0) == (n <= 500));
  }
}

TEST_CASE("A frame that a user's class ends leaves nothing to the next one", "[motions]") {
  const Space space(on_cpu);
  World world(space, denseCube(1500, 74));
  const dGeomID user = world.take(createUserBox(space, {0, 1, 0, 1, 0, 1}));
  (void)collide(space);
  dGeomDisable(world.geoms()[3]);
  setUserBounds(user, {0, 2, 0, 1, 0, 1});
  setUserBoundsObserver([] { throw 0; });
  CHECK_THROWS(collide(space));
  setUserBoundsObserver(nullptr);
  (void)collide(space);
  CHECK(statsOf(space).disabled == 1);
}
