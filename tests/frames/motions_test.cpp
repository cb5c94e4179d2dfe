// What a space keeps from frame to frame must not show: whatever moves, and however the space is
// set, the pairs of every frame are those that its rules owe.
#include <ode_parallel_sap/parallel_sap_space.h>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/events_oracle.h"
#include "support/knobs.h"
#include "support/moving_scene.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/rules_oracle.h"
#include "support/scenes.h"
#include "support/user_box.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

const char* const kNotified = "ODE_PARALLEL_SAP_NOTIFIED";
constexpr double kSlow = 0.001;  // of a width in a frame: little for the thin bars, too

const struct {
  const char* name;
  void (*between)(MovingScene& scene, Random& random, int frame);
} kMotions[] = {
    {"rests but for single changes",
     [](MovingScene& scene, Random&, int frame) {
       if (frame % 4 == 3) scene.edit();
     }},
    {"moves in part",
     [](MovingScene& scene, Random& random, int) {
       constexpr double parts[] = {0, 0, 0.001, 0.01, 0.01, 0.1, 0.5};
       scene.moveSome(parts[random.below(7)]);
       for (int i = 0; i < 3 && random.chance(0.6); ++i) scene.edit();
     }},
    {"drifts",
     [](MovingScene& scene, Random& random, int frame) {
       if (frame % 16 == 15) scene.turnBack();
       if (random.chance(0.8)) scene.drift(random.chance(0.1) ? 0.2 : kSlow);
       while (frame > 3 && random.chance(0.7)) scene.edit();
     }},
    {"trembles",
     [](MovingScene& scene, Random& random, int frame) {
       scene.tremble(random.chance(0.03) ? 0.3 : kSlow);
       while (frame > 2 && random.chance(0.7)) scene.edit();
     }},
    {"rests, trembles and is stirred in turn",
     [](MovingScene& scene, Random& random, int frame) {
       const int phase = frame / 4 % 4;
       if (phase == 1) scene.tremble(kSlow);
       if (phase == 2)
         for (std::size_t i = random.below(20); i > 0; --i) scene.edit();
       if (phase == 3) scene.tremble(random.chance(0.5) ? kSlow : 0.3);
     }},
    {"moves far", [](MovingScene& scene, Random&, int) { scene.tremble(0.4); }},
};

void skip(dSpaceID space, bool of_static, bool asleep) {
  dParallelSAPSpaceSetSkipStatic(space, of_static);
  dParallelSAPSpaceSetSkipAsleep(space, asleep);
}

template <int micrometres>
void tolerate(MovingScene& scene, Random&, int frame) {
  if (frame == 0) dParallelSAPSpaceSetTolerance(scene.space(), micrometres * dReal(1e-6));
}

// Set before the first frame, or on the way.
const struct {
  const char* name;
  double offset;
  void (*set)(MovingScene& scene, Random& random, int frame);
} kSettings[] = {
    {"nothing set", 0, [](MovingScene&, Random&, int) {}},
    {"far from the origin", 3e4, [](MovingScene&, Random&, int) {}},
    {"static pairs left out", 0,
     [](MovingScene& scene, Random&, int) { skip(scene.space(), true, false); }},
    {"pairs asleep left out", 0,
     [](MovingScene& scene, Random&, int) { skip(scene.space(), false, true); }},
    {"pairs at rest left out", 0,
     [](MovingScene& scene, Random&, int) { skip(scene.space(), true, true); }},
    {"planes culled", 0,
     [](MovingScene& scene, Random&, int) { dParallelSAPSpaceSetCullPlanes(scene.space(), 1); }},
    {"a tolerance next to nothing", 0, tolerate<1>},
    {"a tolerance that slow motion keeps within", 0, tolerate<10000>},
    {"a tolerance as large as a box", 0, tolerate<1000000>},
    {"a tolerance, planes culled and pairs at rest left out", 0,
     [](MovingScene& scene, Random& random, int frame) {
       tolerate<100000>(scene, random, frame);
       skip(scene.space(), true, true);
       dParallelSAPSpaceSetCullPlanes(scene.space(), 1);
     }},
    {"the space is told", 0,
     [](MovingScene& scene, Random&, int frame) {
       if (frame == 3) scene.promise();
     }},
    {"the space is told, and pairs at rest left out", 0,
     [](MovingScene& scene, Random&, int frame) {
       skip(scene.space(), true, true);
       if (frame == 3) scene.promise();
     }},
    {"settings change", 0,
     [](MovingScene& scene, Random& random, int frame) {
       const dSpaceID space = scene.space();
       if (frame % 6 != 5) return;
       const dReal tolerances[] = {0, 0, dReal(0.05)};
       dParallelSAPSpaceSetTolerance(space, tolerances[random.below(3)]);
       configure(space, configurations()[random.below(configurations().size())]);
       dParallelSAPSpaceSetNumThreads(space, random.chance(0.5) ? 3 : 1);
       dParallelSAPSpaceSetCullPlanes(space, random.chance(0.3));
       skip(space, random.chance(0.3), random.chance(0.3));
     }},
};

void play(const Configuration& configuration, std::size_t motion, std::size_t setting,
          std::size_t n) {
  const std::uint64_t seed = seedOr(61 + 10 * setting + motion);
  MovingScene scene(configuration, n, seed, {kSettings[setting].offset, true});
  Random random(seed);
  for (int frame = 0; frame < std::max(8, scaled(20)); ++frame) {
    INFO(configuration.name << ", " << kSettings[setting].name << ", " << n << " geoms, all "
                            << kMotions[motion].name << ", frame " << frame
                            << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    kSettings[setting].set(scene, random, frame);
    const Pairs pairs = collide(scene.space());
    REQUIRE(scene.wrong(pairs) == "");
    REQUIRE(wrongCounts(scene.space(), scene.order(), pairs.size()) == "");
    kMotions[motion].between(scene, random, frame);
  }
}

const Configuration on_cpu = {dParallelSAPBackendCPU, dParallelSAPMethodAuto, "auto"};

}  // namespace

TEST_CASE("However all moves and the space is set, the pairs are those that its rules owe",
          "[motions]") {
  const Variable not_notified(kNotified, nullptr);
  constexpr std::size_t sizes[] = {12, 60, 300, 900};
  for (std::size_t setting = 0; setting < std::size(kSettings); ++setting)
    for (std::size_t motion = 0; motion < std::size(kMotions); ++motion) {
      for (const std::size_t n : sizes) play(configurations()[0], motion, setting, n);
      for (std::size_t i = 1; i < configurations().size(); ++i)
        play(configurations()[i], motion, setting, sizes[(setting + motion + i) % 4]);
    }
}

namespace {

// One of the things that programs do between frames of boxes that have nothing special; seldom one
// that makes them special.
void changePlain(World& world, Random& random, std::size_t& next) {
  const dSpaceID space = world.space();
  const dGeomID geom = world.geoms()[random.below(world.geoms().size())];
  switch (random.below(random.chance(0.9) ? 8 : 15)) {
    case 0: {
      const int methods[] = {dParallelSAPMethodSweep, dParallelSAPMethodBruteForce};
      dParallelSAPSpaceSetMethod(
          space, random.chance(0.6) ? dParallelSAPMethodAuto : methods[random.below(2)]);
      break;
    }
    case 1:
      dParallelSAPSpaceSetSkipStatic(space, !dParallelSAPSpaceGetSkipStatic(space));
      break;
    case 2:
      dParallelSAPSpaceSetSkipAsleep(space, !dParallelSAPSpaceGetSkipAsleep(space));
      break;
    case 3:
      dParallelSAPSpaceSetCullPlanes(space, !dParallelSAPSpaceGetCullPlanes(space));
      break;
    case 4:
      dParallelSAPSpaceSetTrace(space, random.chance(0.5) ? "/dev/null" : nullptr, 1);
      break;
    case 5:
      (void)statsOf(space);
      break;
    case 6:
      world.jitter(0.1, random.bits());
      break;
    case 7:
      world.jitter(0.1, random.bits());
      dSpaceClean(space);
      break;
    case 8:
      dGeomIsEnabled(geom) ? dGeomDisable(geom) : dGeomEnable(geom);
      break;
    case 9:
      dGeomSetCategoryBits(geom, random.below(2));
      dGeomSetCollideBits(geom, random.below(2));
      break;
    case 10:
      world.remove(geom);
      world.addAgain(geom);
      setNumber(geom, next++);
      break;
    case 11:
      setNumber(world.take(dCreatePlane(space, 0, 0, 1, 0)), next++);
      break;
    case 12:
      setNumber(
          world.take(createUserBox(space, {0, 1, 0, 1, 0, 1}, false,
                                   [](dGeomID self, dGeomID other, dReal*) {
                                     return static_cast<int>((number(self) ^ number(other)) % 2);
                                   })),
          next++);
      break;
    case 13:
      for (const Box& box : denseCube(random.below(60), random.bits()))
        setNumber(world.addBox(box), next++);
      break;
    default:
      (void)collide2(space, geom);
  }
}

}  // namespace

TEST_CASE("What is done to plain boxes between frames, most of them at rest, the next one sees",
          "[motions]") {
  for (const std::size_t n : {2, 3, 4, 7, 32, 33, 40, 130})
    for (int run = 0; run < scaled(40); ++run) {
      const std::uint64_t seed = seedOr(131 + n, run);
      Random random(seed);
      const Space space;
      World world(space);
      world.addBoxes(denseCube(n, seed));
      EventsOracle oracle;
      bool events = false;
      std::size_t next = n;
      for (int frame = 0; frame < 50; ++frame) {
        if (random.chance(0.5)) changePlain(world, random, next);
        if (random.chance(0.05)) {
          dParallelSAPSpaceSetEvents(space, events = !events);
          oracle = EventsOracle();
        }
        const Pairs pairs = collide(space);
        INFO(n << " boxes, frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        REQUIRE(wrongByRules(Rules::of(space), world.geoms(), pairs) == "");
        REQUIRE(wrongCounts(space, world.geoms(), pairs.size()) == "");
        if (events)
          REQUIRE(oracle.check(space, pairs, EventsOracle::byNumber(world.geoms())) == "");
      }
    }
}

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
            const bool plane = dGeomGetClass(geom) == dPlaneClass;
            const dReal* const at = plane ? nullptr : dGeomGetPosition(geom);
            if (plane)
              dGeomPlaneSetParams(geom, 0, 0, 1, real(random.between(1, 3)));
            else
              dGeomSetPosition(geom, at[0], at[1], at[2] + real(frame % 8 == 3 ? 0.001 : 0.3));
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
          std::size_t pairs = 0, touching = 0;
          const Pairs expected = frame % 3 == 2 ? collide(space) : Pairs();
          if (frame % 3 == 2) pairs = expected.size();
          if (frame % 3 == 1)
            dParallelSAPSpaceCollidePairs(
                space, &pairs, 0,
                [](void* pairs, const dParallelSAPPair*, std::size_t count, std::size_t) {
                  *static_cast<std::size_t*>(pairs) += count;
                });
          if (frame % 3 == 0) {
            const dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf(
                [](void* contacts, dGeomID, dGeomID, const dContactGeom*, int count) {
                  *static_cast<std::size_t*>(contacts) += static_cast<std::size_t>(count);
                });
            dParallelSAPSpaceCollideContacts(space, &touching, 4, &callbacks);
            pairs = statsOf(space).pairs;
          }
          const dParallelSAPStats stats = statsOf(space);
          REQUIRE(wrongCounts(space, geoms, pairs) == "");
          REQUIRE(stats.moved == moved.size());
          REQUIRE(stats.contacts == touching);
          // Those of two geoms that stayed where they were, at most.
          const auto stays = [&](const Pair& pair) {
            return std::none_of(moved.begin(), moved.end(), [&](dGeomID geom) {
              return number(geom) == pair.first || number(geom) == pair.second;
            });
          };
          if (frame % 3 == 2)
            REQUIRE(stats.kept <= static_cast<std::size_t>(
                                      std::count_if(expected.begin(), expected.end(), stays)));
          REQUIRE(stats.frames == static_cast<unsigned>(frame) + 1);
          const auto runs = [](int what, int asked, int automatic) {
            return asked == automatic ? what != automatic : what == asked;
          };
          REQUIRE(runs(stats.backend, configuration.backend, dParallelSAPBackendAuto));
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

TEST_CASE("The greatest tolerance misses no pair of geoms at infinity", "[motions]") {
  MovingScene scene(on_cpu, 120, 70);
  dParallelSAPSpaceSetTolerance(scene.space(), std::numeric_limits<dReal>::max());
  for (int frame = 0; frame < 40; ++frame, scene.edit())
    REQUIRE(scene.wrong(collide(scene.space())) == "");
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
          for (int frame = 0; frame < 3; ++frame) {
            INFO("scale " << scale << ", tolerance " << tolerance << " of it, " << small
                          << " small ones, outlier " << outlier << ", frame " << frame);
            const Pairs pairs = collide(space);
            REQUIRE(wrongByRules(Rules::of(space), world.geoms(), pairs) == "");
          }
        }
}

TEST_CASE("Candidates are kept where all trembles, and given back after", "[motions]") {
  MovingScene scene(on_cpu, 1500, 122);
  const auto frames = [&](int count, double distance) {
    std::size_t kept = 0;
    for (int frame = 0; frame < count; ++frame) {
      if (distance > 0) scene.tremble(distance);
      const Pairs pairs = collide(scene.space());
      const std::size_t candidates = statsOf(scene.space()).candidates_kept;
      if (candidates > 0) CHECK(candidates < 2 * pairs.size());
      kept += candidates >= pairs.size() * 9 / 10;
    }
    return kept;
  };
  CHECK(frames(40, 0.4) == 0);
  CHECK(frames(40, kSlow) > 30);
  (void)frames(20, 0);
  const std::size_t held = statsOf(scene.space()).memory_bytes;
  (void)frames(80, 0);
  CHECK(statsOf(scene.space()).memory_bytes + 36 * 1500 < held);
  CHECK(frames(10, kSlow) > 5);
}

TEST_CASE("Candidates are kept where all that ODE calls moved is where it was", "[motions]") {
  const Space space(on_cpu);
  World world(space);
  world.addBoxes(denseCube(1500, 123));
  for (int frame = 0; frame < 4; ++frame) {
    (void)collide(space);
    CHECK((statsOf(space).candidates_kept > 0) == (frame > 1));
    for (const dGeomID geom : world.geoms()) {
      const dReal* const at = dGeomGetPosition(geom);
      dGeomSetPosition(geom, at[0], at[1], at[2]);
    }
  }
}

TEST_CASE(
    "With a tolerance near pairs are let through, the same on any number of threads, told of "
    "changes or not, without a report, and whatever was in memory",
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
  Space spaces[3];
  for (const Space& space : spaces) dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
  World one(spaces[0]), two(spaces[1]), silent(spaces[2]);
  World* const worlds[] = {&one, &two, &silent};
  for (int i = 0; i < 3; ++i) {
    worlds[i]->addBoxes(denseCube(3000, 67));
    for (const int geom : {0, 2}) {  // so that bits decide
      dGeomSetCategoryBits(worlds[i]->geoms()[geom], 1 + geom);
      dGeomSetCollideBits(worlds[i]->geoms()[geom], 4);
    }
    for (std::size_t geom = 1; geom < 3000; geom += 4) dGeomDisable(worlds[i]->geoms()[geom]);
    dParallelSAPSpaceSetTolerance(spaces[i], 0.1);
    dParallelSAPSpaceSetNumThreads(spaces[i], i + 1);
  }
  dParallelSAPSpaceSetNotified(spaces[2], 1);
  for (int frame = 0; frame < 80; ++frame) {
    INFO("frame " << frame);
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

TEST_CASE("A frame that a user's class ends leaves nothing to the next one", "[motions]") {
  const Space space(on_cpu);
  World world(space);
  world.addBoxes(denseCube(1500, 74));
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
