// What ODE_PARALLEL_SAP_STATS=1 says in its last line would have saved time, and when it is silent.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/ode_errors.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

const char* const kStatic = "ODE_PARALLEL_SAP_SKIP_STATIC=1";
const char* const kAsleep = "ODE_PARALLEL_SAP_SKIP_ASLEEP=1";
const char* const kPlanes = "ODE_PARALLEL_SAP_CULL_PLANES=1";
const char* const kLayers = "collide bits that keep categories 0x2 and 0x4 apart";

// So that what is seen differs from what is by some hundredths.
constexpr unsigned long long kSamples = 1500;

// What this thread has had of a core.
double threadMs() {
  std::timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1000.0 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

void work(int turns) {
  volatile int sum = 0;
  for (int i = 0; i < turns; ++i) sum = sum + i;
}

// Of a microsecond, so that frames are callbacks and little else.
void workOnPair(void*, dGeomID, dGeomID) {
  work(700);
}

void workUnlessStatic(void*, dGeomID a, dGeomID b) {
  if (dGeomGetBody(a) || dGeomGetBody(b)) work(3000);
}

void ignoreContacts(void*, dGeomID, dGeomID, const dContactGeom*, int) {}

enum class Bodies { none, asleep, awake };

void add(World& world, const Boxes& boxes, Bodies bodies, double side = 0) {
  for (Box box : boxes) {
    box.low[1] += side;
    box.high[1] += side;
    const dGeomID geom = world.addBox(box);
    if (bodies == Bodies::none) continue;
    const dBodyID body = world.giveBody(geom);
    if (bodies == Bodies::asleep) dBodyDisable(body);
  }
}

void addPlane(World& world, dReal x, dReal y, dReal z, dReal distance) {
  world.take(dCreatePlane(world.space(), x, y, z, distance));
}

// A row of spheres with bodies, of one category after the other: neighbours touch by turns, where
// categories are equal, or overlap in nothing but their boxes.
void addLayers(World& world, int count, const std::vector<unsigned long>& categories) {
  for (int i = 0; i < count; ++i) {
    const dGeomID sphere = world.take(dCreateSphere(world.space(), dReal(0.5)));
    const dReal diagonal = i % 2 ? dReal(0.8) : 0;
    dGeomSetPosition(sphere, dReal(0.8) * static_cast<dReal>(i), diagonal, diagonal);
    dGeomSetCategoryBits(sphere, categories[static_cast<std::size_t>(i) % categories.size()]);
    world.giveBody(sphere);
  }
  // Neighbours of one category, which touch.
  for (int i = 0; i < count; ++i) {
    const dGeomID sphere = world.take(dCreateSphere(world.space(), dReal(0.5)));
    dGeomSetPosition(sphere, dReal(0.8) * static_cast<dReal>(i), 100, 0);
    dGeomSetCategoryBits(sphere, categories[0]);
    world.giveBody(sphere);
  }
}

struct Run {
  using Collide = std::function<void(dSpaceID)>;
  std::string line;            // the last that was said, or nothing
  dParallelSAPStats stats;     // of the last frame
  double share[3];             // of the pairs: static, asleep, clear of a plane
  double total_ms, report_ms;  // of all frames
  double of_pairs_ms;          // that which goes by the number of pairs
};

void collideWorking(dSpaceID space) {
  dSpaceCollide(space, nullptr, workOnPair);
}

void collideForContacts(dSpaceID space) {
  const dParallelSAPContactCallbacks callbacks = {ignoreContacts, nullptr, nullptr, nullptr};
  dParallelSAPSpaceCollideContacts(space, nullptr, 4, &callbacks);
}

// Of all pairs, what a setting leaves out.
double leftOut(dSpaceID space, void (*set)(dSpaceID, int)) {
  const double all = static_cast<double>(collide(space).size());
  set(space, 1);
  const double left = static_cast<double>(collide(space).size());
  set(space, 0);
  return all > 0 ? 1 - left / all : 0;
}

// Of the pairs, those of the categories 2 and 4.
double shareOfLayers(const std::function<void(World&)>& populate) {
  const Space space;
  World world(space);
  populate(world);
  const Pairs pairs = collide(space);
  const auto categoryOf = [&](std::size_t geom) {
    return dGeomGetCategoryBits(world.geoms()[geom]);
  };
  double of_both = 0;
  for (const Pair& pair : pairs) of_both += (categoryOf(pair.first) | categoryOf(pair.second)) == 6;
  return of_both / static_cast<double>(pairs.size());
}

Run run(const std::function<void(World&)>& populate, const Run::Collide& collide_once,
        unsigned long long samples = kSamples) {
  Run run = {};
  {
    const Space space;
    World world(space);
    populate(world);
    run.share[0] = leftOut(space, dParallelSAPSpaceSetSkipStatic);
    run.share[1] = leftOut(space, dParallelSAPSpaceSetSkipAsleep);
    run.share[2] = leftOut(space, dParallelSAPSpaceSetCullPlanes);
  }
  const Variable stats("ODE_PARALLEL_SAP_STATS", "1");
  const Messages messages;
  {
    const Space space;
    World world(space);
    populate(world);
    for (int frame = 0; frame < 100000 && run.stats.sampled < samples; ++frame) {
      collide_once(space);
      run.stats = statsOf(space);
      run.total_ms += run.stats.total_ms;
      run.report_ms += run.stats.report_ms;
      run.of_pairs_ms += run.stats.extract_ms + run.stats.filter_ms + run.stats.report_ms;
    }
    REQUIRE(run.stats.sampled >= samples);
  }
  REQUIRE(!messages.all().empty());
  if (messages.all().size() > 1) run.line = messages.all().back();
  CHECK(messages.all().size() <= 2);
  return run;
}

// What is said to be saved by `means`, and the share of the pairs; 0 where it is not named.
struct Said {
  double saved = 0, pairs = 0;
};
Said saidOf(const std::string& line, const std::string& means) {
  const std::size_t at = line.find(" % by " + means);
  if (at == std::string::npos) return {};
  const std::size_t number = line.rfind(' ', at - 1), pairs = line.find('(', at);
  return {std::atof(line.c_str() + number) / 100, std::atof(line.c_str() + pairs + 1) / 100};
}

struct Scene {
  const char* name;
  std::function<void(World&)> populate;
};

// In each of the scenes much would be saved by one setting, and what is said of all three is right.
void checkScenes(const std::vector<Scene>& scenes, int much) {
  const char* const means[] = {kStatic, kAsleep, kPlanes};
  for (const Scene& scene : scenes) {
    const Run seen = run(scene.populate, collideWorking);
    INFO(scene.name << ": " << seen.line);
    CHECK(seen.share[much] > 0.2);
    const dParallelSAPStats& stats = seen.stats;
    const unsigned long long counts[] = {stats.sampled_static, stats.sampled_asleep,
                                         stats.sampled_clear};
    for (int i = 0; i < 3; ++i) {
      INFO(means[i] << " leaves out " << seen.share[i]);
      const Said said = saidOf(seen.line, means[i]);
      const double counted = static_cast<double>(counts[i]) / static_cast<double>(stats.sampled);
      CHECK(std::fabs(counted - seen.share[i]) < 0.08);
      CHECK(std::fabs(said.saved - seen.share[i] * seen.of_pairs_ms / seen.total_ms) < 0.1);
      CHECK(std::fabs(said.pairs - seen.share[i]) < 0.08);
      if (seen.share[i] == 0) CHECK(counts[i] == 0);
    }
    CHECK(stats.sampled_collided == 0);
  }
}

}  // namespace

TEST_CASE("Where static geoms meet each other, leaving that out is said to save it", "[hints]") {
  checkScenes({{"a lattice and some bodies",
                [](World& world) {
                  add(world, touchingLattice(300, 1), Bodies::none);
                  add(world, denseCube(100, 2), Bodies::awake, 100);
                }},
               {"a layer of tiles and a heap",
                [](World& world) {
                  add(world, flatLayer(1500, 1), Bodies::none);
                  add(world, heap(300, 2), Bodies::awake, 200);
                }},
               {"a small scene",
                [](World& world) {
                  add(world, denseCube(60, 1), Bodies::none);
                  add(world, denseCube(40, 2), Bodies::awake, 100);
                }},
               {"one large box and much dust",
                [](World& world) { add(world, giantAmongDust(400, 1), Bodies::none); }},
               {"walls and planes that lie in them",
                [](World& world) {
                  add(world, longBars(400, 1), Bodies::none);
                  addPlane(world, 0, 0, 1, 1);
                  add(world, denseCube(150, 3), Bodies::awake, 300);
                }}},
              0);
}

TEST_CASE("Where sleepers meet each other, leaving that out is said to save it", "[hints]") {
  checkScenes({{"a heap at rest",
                [](World& world) {
                  add(world, heap(1000, 1), Bodies::asleep);
                  add(world, denseCube(100, 2), Bodies::awake, 200);
                }},
               {"a lattice at rest on the ground",
                [](World& world) {
                  add(world, touchingLattice(300, 1), Bodies::asleep);
                  add(world, {{{-50, -50, -1}, {50, 50, 0}}}, Bodies::none);
                }},
               {"a small scene",
                [](World& world) {
                  add(world, denseCube(80, 1), Bodies::asleep);
                  add(world, denseCube(20, 2), Bodies::awake, 100);
                }},
               {"clusters", [](World& world) { add(world, clusters(600, 1), Bodies::asleep); }},
               {"among awake ones",
                [](World& world) {
                  add(world, denseCube(600, 1), Bodies::asleep);
                  add(world, denseCube(600, 2), Bodies::awake);
                }}},
              1);
}

TEST_CASE("Where planes are clear of geoms, leaving that out is said to save it", "[hints]") {
  checkScenes({{"an oblique plane far off",
                [](World& world) {
                  add(world, denseCube(600, 1), Bodies::awake);
                  addPlane(world, 1, 1, 1, -1000);
                  addPlane(world, 1, 2, 1, -1000);
                }},
               {"a small scene",
                [](World& world) {
                  add(world, denseCube(100, 1), Bodies::awake);
                  addPlane(world, 1, 1, 1, -1000);
                  addPlane(world, 1, 0, 1, -1000);
                  addPlane(world, 0, 1, 1, -1000);
                }},
               {"a layer under a roof",
                [](World& world) {
                  add(world, flatLayer(800, 1), Bodies::awake);
                  addPlane(world, 1, 1, -10, -1000);
                  addPlane(world, -1, 1, -10, -1000);
                }},
               {"clusters between planes",
                [](World& world) {
                  add(world, clusters(500, 1), Bodies::awake);
                  for (int i = 0; i < 60; ++i)
                    addPlane(world, 1, static_cast<dReal>(i), 2, -100000);
                }},
               {"a hopper",
                [](World& world) {
                  add(world, heap(400, 1), Bodies::awake);
                  for (const dReal side : {-1, 1}) {
                    addPlane(world, side, 0, 1, -60);
                    addPlane(world, 0, side, 1, -60);
                  }
                }}},
              2);
}

TEST_CASE("Categories that never touch are named where they cost", "[hints]") {
  struct Case {
    const char* name;
    int count;
    std::vector<unsigned long> categories;
  };
  for (const Case& c : {Case{"two", 600, {2, 4}},
                        {"a small scene", 50, {2, 4}},
                        {"the other one first", 600, {4, 2}},
                        {"three, of which two pairs touch not", 900, {2, 4, 2, 4, 8, 8}},
                        {"more of one than of the other", 600, {2, 4, 2}}}) {
    const auto populate = [&](World& world) { addLayers(world, c.count, c.categories); };
    const Run seen = run(populate, collideForContacts);
    INFO(c.name << ": " << seen.line);
    const double truth = shareOfLayers(populate);
    const Said said = saidOf(seen.line, kLayers);
    CHECK(truth > 0.2);
    CHECK(std::fabs(said.pairs - truth) < 0.08);
    CHECK(said.saved > 0.3 * truth);  // no contact of theirs is reported
    CHECK(said.saved < truth + 0.1);
    CHECK(seen.stats.sampled_collided == seen.stats.sampled);
    CHECK(seen.stats.sampled_untouched > 0);
    CHECK(seen.stats.sampled_untouched < seen.stats.sampled);
  }
}

TEST_CASE("Nothing is said where nothing would be saved", "[hints]") {
  const auto heapOfBodies = [](World& world) { add(world, heap(500, 1), Bodies::awake); };
  const auto skipAll = [](World& world) {
    add(world, denseCube(300, 1), Bodies::none);
    add(world, denseCube(300, 2), Bodies::asleep, 100);
    add(world, denseCube(300, 3), Bodies::awake, 200);
    addPlane(world, 1, 1, 1, -1000);
  };
  struct Case {
    const char* name;
    std::function<void(World&)> populate;
    Run::Collide collide;
    unsigned long long samples;
  };
  for (const Case& c :
       {Case{"a heap of bodies", heapOfBodies, collideWorking, kSamples},
        {"a heap of bodies and their contacts", heapOfBodies, collideForContacts, kSamples},
        {"what may be left out is", skipAll,
         [](dSpaceID space) {
           dParallelSAPSpaceSetSkipStatic(space, 1);
           dParallelSAPSpaceSetSkipAsleep(space, 1);
           dParallelSAPSpaceSetCullPlanes(space, 1);
           collideWorking(space);
         },
         kSamples},
        {"too little to tell", [](World& world) { add(world, denseCube(300, 1), Bodies::none); },
         collideWorking, 4}}) {
    const Run seen = run(c.populate, c.collide, c.samples);
    INFO(c.name);
    CHECK(seen.line == "");
  }
}

// Unless the machine was busy elsewhere while it found pairs, callbacks are nearly all of the time.
TEST_CASE("Nothing is said of pairs for which the callback does nothing", "[hints]") {
  int runs = 0;
  const auto runOnce = [&] {
    ++runs;
    return run(
        [](World& world) {
          add(world, denseCube(100, 1), Bodies::none);
          add(world, denseCube(1500, 2), Bodies::awake, 100);
        },
        [](dSpaceID space) { dSpaceCollide(space, nullptr, workUnlessStatic); });
  };
  Run seen = runOnce();
  while (seen.report_ms < 0.9 * seen.total_ms && runs < 20) seen = runOnce();
  REQUIRE(seen.report_ms >= 0.9 * seen.total_ms);
  CHECK(seen.share[0] > 0.02);
  CHECK(seen.share[0] * 0.1 < 0.01);  // what is said is a hundredth at least
  CHECK(seen.line == "");
}

TEST_CASE("A callback that is interrupted at first is not taken for all", "[hints]") {
  static int calls;
  calls = 0;
  const Run seen = run(
      [](World& world) {
        add(world, denseCube(500, 1), Bodies::awake);  // first, so that the first pair is of these
        add(world, denseCube(500, 2), Bodies::none, 100);
      },
      [](dSpaceID space) {
        dSpaceCollide(space, nullptr,
                      [](void*, dGeomID, dGeomID) { work(calls++ ? 700 : 7000000); });
      });
  INFO(seen.line);
  CHECK(seen.share[0] > 0.4);
  CHECK(std::fabs(saidOf(seen.line, kStatic).saved -
                  seen.share[0] * seen.of_pairs_ms / seen.total_ms) < 0.1);
}

TEST_CASE("Pairs are sampled where statistics are printed, and nowhere else", "[hints]") {
  const Variable stats("ODE_PARALLEL_SAP_STATS", nullptr);
  const Space space;
  World world(space);
  add(world, denseCube(300, 1), Bodies::none);
  for (int frame = 0; frame < 100; ++frame) collideWorking(space);
  CHECK(statsOf(space).sampled == 0);
  CHECK(statsOf(space).sampled_static == 0);
}

// A pair takes some 0.2 us, so that is less than half a percent.
TEST_CASE("Of a frame's time one pair in 50 microseconds is sampled, whatever its pairs",
          "[hints]") {
  const Variable stats("ODE_PARALLEL_SAP_STATS", "1");
  const Messages messages;
  for (const std::size_t n : {20, 100, 3000})
    for (const int turns : {0, 1000}) {
      const Space space;
      World world(space);
      add(world, denseCube(n, 1), Bodies::awake);
      static int turns_now;
      turns_now = turns;
      double ms = 0;
      const double before = threadMs();
      while (ms < 80) {
        dSpaceCollide(space, nullptr, [](void*, dGeomID, dGeomID) { work(turns_now); });
        ms += statsOf(space).total_ms;
      }
      // While another program has the core nothing can be picked.
      const double own_ms = std::min(ms, threadMs() - before);
      INFO(n << " geoms, " << turns << " turns a callback");
      const double sampled = static_cast<double>(statsOf(space).sampled);
      CHECK(sampled > 0.6 * own_ms / 0.05);
      CHECK(sampled < 1.5 * ms / 0.05);
    }
}

TEST_CASE("Pairs in blocks are sampled, too", "[hints]") {
  const Run seen = run(
      [](World& world) {
        add(world, denseCube(500, 1), Bodies::none);
        add(world, denseCube(500, 2), Bodies::awake, 100);
      },
      [](dSpaceID space) {
        dParallelSAPSpaceCollidePairs(
            space, nullptr, 0, [](void*, const dParallelSAPPair*, std::size_t count, std::size_t) {
              work(700 * static_cast<int>(count));
            });
      });
  INFO(seen.line);
  CHECK(std::fabs(saidOf(seen.line, kStatic).saved -
                  seen.share[0] * seen.of_pairs_ms / seen.total_ms) < 0.1);
}
