// Batches of probes: the contacts of a loop over dSpaceCollide2 and dCollide, bit for bit, whoever
// finds them.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/contact_scene.h"
#include "support/floating_point.h"
#include "support/knobs.h"
#include "support/moving_scene.h"
#include "support/nested_scene.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/overlap_oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

const int kTeams[] = {1, 2, 3, 16};

// Probes in no space or in another one, each at a geom of the scene.
class ProbeSet {
 public:
  explicit ProbeSet(std::size_t n, Random& random) : random_(random) {
    for (std::size_t i = 0; i < n; ++i) {
      const dSpaceID space = random_.chance(0.5) ? dSpaceID(other_) : nullptr;
      const std::size_t kind = random_.below(4);  // convexes may not meet all meshes of the scenes
      probes_.push_back({kind == 0   ? dCreateSphere(space, 1)
                         : kind == 1 ? dCreateBox(space, 1, 2, dReal(0.5))
                         : kind == 2 ? dCreateCapsule(space, dReal(0.4), 1)
                                     : dCreateCylinder(space, dReal(0.4), 1),
                         nullptr, 0});
    }
  }
  ~ProbeSet() {
    for (const dParallelSAPProbe& probe : probes_) dGeomDestroy(probe.geom);
  }
  ProbeSet(const ProbeSet&) = delete;
  ProbeSet& operator=(const ProbeSet&) = delete;

  void moveTo(const std::vector<dGeomID>& geoms) {
    for (dParallelSAPProbe& probe : probes_) {
      const dGeomID at = geoms[random_.below(geoms.size())];
      dReal bounds[6], place[3];
      dGeomGetAABB(at, bounds);
      for (int axis = 0; axis < 3; ++axis) {
        place[axis] = bounds[2 * axis] + (bounds[2 * axis + 1] - bounds[2 * axis]) *
                                             static_cast<dReal>(random_.between(-0.2, 1.2));
        if (!std::isfinite(place[axis])) place[axis] = static_cast<dReal>(random_.gauss());
      }
      dGeomSetPosition(probe.geom, place[0], place[1], place[2]);
      dMatrix3 turned;
      dRFromEulerAngles(turned, static_cast<dReal>(random_.gauss()), 1, place[0]);
      dGeomSetRotation(probe.geom, turned);
      probe.ignore = random_.chance(0.3) ? dGeomGetBody(at) : nullptr;
      if (random_.chance(0.1)) dGeomSetCategoryBits(probe.geom, random_.below(16));
      if (random_.chance(0.1)) dGeomSetCollideBits(probe.geom, random_.below(16));
      if (random_.chance(0.1)) dGeomDisable(probe.geom);
    }
  }
  const Probes& probes() const { return probes_; }

 private:
  Random& random_;
  const Space other_;
  Probes probes_;
};

constexpr int kUnimportant = 1 | static_cast<int>(CONTACTS_UNIMPORTANT);

// The space goes first: the oracle brings geoms up to date.
std::size_t countOverlaps(dSpaceID space, Probes probes, int flags) {
  return dParallelSAPSpaceOverlaps(space, probes.data(), probes.size(), sizeof probes[0], flags,
                                   nullptr, nullptr);
}

std::size_t touching(const std::vector<Contacts>& owed) {
  std::size_t count = 0;
  for (const Contacts& each : owed) count += !each.empty();
  return count;
}

}  // namespace

TEST_CASE("Probes touch what a loop over dCollide finds, in every scene and as it moves",
          "[overlaps]") {
  const std::uint64_t seed = seedOr(501);
  for (const WorldScene& scene : worldScenes())
    for (const std::size_t n : {1, 100, 700}) {
      if (n > scene.most) continue;
      const Space space;
      World world(space);
      scene.populate(world, n, seed);
      Random random(seed);
      ProbeSet set(50, random);
      dParallelSAPSpaceSetCullPlanes(space, n == 100);
      std::size_t touch = 0;
      for (const double distance : {0.0, 0.01, 3.0}) {
        set.moveTo(world.geoms());
        if (distance > 0) world.jitter(distance, random.bits());
        const int flags = static_cast<int>(random.below(9));
        const std::size_t first = countOverlaps(space, set.probes(), flags);
        const std::vector<Contacts> owed = owedOverlaps(space, set.probes(), flags);
        CHECK(first == countOverlaps(space, set.probes(), flags));
        for (const int threads : kTeams) {
          INFO(scene.name << ", " << n << " geoms, moved by " << distance << ", " << threads
                          << " threads, flags " << flags
                          << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
          dParallelSAPSpaceSetNumThreads(space, threads);
          REQUIRE(wrongOverlaps(space, set.probes(), flags, owed) == "");
        }
        touch += touching(owed);
        // ODE writes not all contacts then.
        CHECK(countOverlaps(space, set.probes(), kUnimportant | dParallelSAPOverlapAny) ==
              touching(owedOverlaps(space, set.probes(), kUnimportant)));
      }
      CHECK(touch > (scene.name == "mixed bits" || n == 1 ? 0 : 20));
    }
}

TEST_CASE("Meshes, heightfields and users' classes touch alike on any number of threads",
          "[overlaps]") {
  const std::uint64_t seed = seedOr(511);
  const Space space, other;
  std::vector<Kind> kinds;
  for (int kind = 0; kind < static_cast<int>(Kind::Plane); ++kind)
    if (static_cast<Kind>(kind) != Kind::FixedHeightfield) kinds.push_back(static_cast<Kind>(kind));
  ContactScene scene(space), probing(other);
  scene.fill(kinds, 200, seed);
  scene.add(Kind::Plane, 1, seed);
  probing.fill(kinds, 60, seed + 1);
  Probes probes;
  for (int i = 0; i < dSpaceGetNumGeoms(other); ++i) {
    const dBodyID some = dGeomGetBody(dSpaceGetGeom(space, 3 * i));
    probes.push_back({dSpaceGetGeom(other, i), i % 3 ? nullptr : some, 0});
  }
  Random random(seed);
  for (int frame = 0; frame < 4; ++frame) {
    scene.move(random.bits());
    probing.move(random.bits());
    const int flags = 1 + static_cast<int>(random.below(8));
    const std::size_t first = countOverlaps(space, probes, flags);
    const std::vector<Contacts> owed = owedOverlaps(space, probes, flags);
    CHECK(first == countOverlaps(space, probes, flags));
    userCodeKeptToThisThread();
    for (const int threads : kTeams) {
      INFO(threads << " threads, flags " << flags << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      dParallelSAPSpaceSetNumThreads(space, threads);
      REQUIRE(wrongOverlaps(space, probes, flags, owed) == "");
      CHECK(userCodeKeptToThisThread());
    }
    CHECK(userCodeCalls() > 0);
    CHECK(touching(owed) > 30);
  }
}

TEST_CASE("Probes see the geoms of spaces within the space, but those of the body they ignore",
          "[overlaps]") {
  const std::uint64_t seed = seedOr(521);
  Random random(seed);
  const Space space;
  World world(space);
  std::vector<dSpaceID> spaces;
  for (int i = 0; i < 60; ++i) {
    const dSpaceID parent = i >= 30 ? spaces[random.below(spaces.size())] : dSpaceID(space);
    spaces.push_back(i % 3 == 0   ? dSimpleSpaceCreate(parent)
                     : i % 3 == 1 ? dHashSpaceCreate(parent)
                                  : dParallelSAPSpaceCreate(parent));
    if (i < 30) world.take(asGeom(spaces.back()));
    if (random.chance(0.1)) dGeomSetCategoryBits(asGeom(spaces.back()), 1);
    if (random.chance(0.1)) dGeomDisable(asGeom(spaces.back()));
  }
  std::vector<dGeomID> inside = {dCreateSphere(spaces[0], 2)};
  const dBodyID robots[] = {dBodyCreate(world.dynamics()), dBodyCreate(world.dynamics())};
  for (int i = 0; i < 400; ++i) {
    const Shape& shape = shapes()[random.below(shapes().size())];
    if (!shape.placeable) continue;
    inside.push_back(shape.create(spaces[random.below(spaces.size() - 1)]));
    if (i % 3 == 0) dGeomSetBody(inside.back(), robots[i % 2]);
    dGeomSetPosition(inside.back(), static_cast<dReal>(random.between(0, 5)),
                     static_cast<dReal>(random.between(0, 5)), 3);
  }
  // Of a class with an AABBTest, which may object to a whole space.
  const auto objects = [](dGeomID, dGeomID to, dReal*) { return int(!dGeomIsSpace(to)); };
  const dGeomID picky = createUserBox(nullptr, {0, 5, 0, 5, 0, 5}, false, objects);
  createUserBox(spaces[0], {0, 5, 0, 5, 0, 5}, false,
                [](dGeomID, dGeomID to, dReal*) { return int(dGeomGetClass(to) == dBoxClass); });
  ProbeSet set(100, random);
  for (int frame = 0; frame < 5; ++frame) {
    set.moveTo(inside);
    for (const dGeomID geom : inside)
      if (random.chance(0.1))
        dGeomSetPosition(geom, static_cast<dReal>(random.between(0, 5)), 2, 3);
    Probes probes = set.probes();
    probes.push_back({picky, nullptr, 0});
    probes.push_back({inside[0], nullptr, 0});  // of the space itself
    dSpaceClean(space);
    const std::vector<Contacts> owed = owedOverlaps(space, probes, 3);
    for (const int threads : kTeams) {
      INFO("frame " << frame << ", " << threads << " threads, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      dParallelSAPSpaceSetNumThreads(space, threads);
      REQUIRE(wrongOverlaps(space, probes, 3, owed) == "");
    }
    CHECK(touching(owed) > 30);
  }
  dGeomDestroy(picky);
}

TEST_CASE("Probes see the geoms of large spaces within the space, as these change", "[overlaps]") {
  const std::uint64_t seed = seedOr(523);
  for (int scene = 0; scene < scaled(4); ++scene) {
    NestedScene nested(seed + static_cast<std::uint64_t>(scene));
    Random random(seed);
    ProbeSet set(60, random);
    std::size_t touch = 0;
    for (int frame = 0; frame < 12; ++frame) {
      if (frame > 0) nested.change();
      set.moveTo(nested.inside());
      const std::size_t first = countOverlaps(nested.space(), set.probes(), 3);
      const std::vector<Contacts> owed = owedOverlaps(nested.space(), set.probes(), 3);
      CHECK(first == countOverlaps(nested.space(), set.probes(), 3));
      for (const int threads : kTeams) {
        INFO("scene " << scene << ", frame " << frame << ", " << threads
                      << " threads, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        dParallelSAPSpaceSetNumThreads(nested.space(), threads);
        REQUIRE(wrongOverlaps(nested.space(), set.probes(), 3, owed) == "");
      }
      touch += touching(owed);
    }
    CHECK(touch > 200);
  }
}

TEST_CASE("Probes keep up with a space that is edited between them", "[overlaps]") {
  const std::uint64_t seed = seedOr(531);
  Random random(seed);
  MovingScene scene(configurations()[0], 200, seed, {0, false});
  ProbeSet set(20, random);
  for (int step = 0; step < scaled(200); ++step) {
    scene.edit();
    if (random.chance(0.1)) scene.moveSome(0.1);
    if (random.chance(0.1)) (void)collide(scene.space());
    set.moveTo(scene.order());
    INFO("step " << step << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    const std::size_t first = countOverlaps(scene.space(), set.probes(), 2);
    const std::vector<Contacts> owed = owedOverlaps(scene.space(), set.probes(), 2);
    REQUIRE(first == countOverlaps(scene.space(), set.probes(), 2));
    REQUIRE(wrongOverlaps(scene.space(), set.probes(), 2, owed) == "");
  }
}

TEST_CASE("A probe with a bound that is no number touches nothing, with one message",
          "[overlaps]") {
  const Space space;
  dCreateSphere(space, 1);
  dCreatePlane(space, 0, 0, 1, 0);
  const dReal nan = std::numeric_limits<dReal>::quiet_NaN();
  const dGeomID lost = createUserBox(nullptr, {0, nan, 0, 1, 0, 1}),
                ball = dCreateSphere(nullptr, 1);
  const dGeomID point = dCreateSphere(nullptr, 0);
  const dGeomID last = dCreateSphere(nullptr, 1);
  Probes probes = {{ball, nullptr, 9}, {lost, nullptr, 9}, {point, nullptr, 9}, {last, nullptr, 9}};
  const std::vector<Contacts> owed = owedOverlaps(space, {probes[2]}, 1);
  const Messages messages;
  for (int i = 0; i < 2; ++i)
    CHECK(dParallelSAPSpaceOverlaps(space, probes.data(), 4, sizeof probes[0], 1, nullptr,
                                    nullptr) == 4 + owed[0].size());
  CHECK(probes[0].touched == 2);
  CHECK(probes[1].touched == 0);
  CHECK(probes[2].touched == owed[0].size());
  CHECK(messages.all().size() <= 1);
  for (const dGeomID geom : {lost, ball, point, last}) dGeomDestroy(geom);
}

TEST_CASE("The callback of overlaps may throw, collide and ask again", "[overlaps]") {
  const std::uint64_t seed = seedOr(541);
  Random random(seed);
  const Space space;
  World world(space);
  world.addBoxes(denseCube(300, seed));
  ProbeSet set(40, random);
  set.moveTo(world.geoms());
  struct Nest {
    dSpaceID space;
    const Probes& probes;
    const std::vector<Contacts> owed;
    std::string problem;
    std::size_t calls;
  } nest{space, set.probes(), owedOverlaps(space, set.probes(), 2), "", 0};
  const auto ask = [](void* data, std::size_t, dGeomID, const dContactGeom*, int) {
    Nest& n = *static_cast<Nest*>(data);
    if (++n.calls % 16 == 1) n.problem += wrongOverlaps(n.space, n.probes, 2, n.owed);
  };
  Probes probes = set.probes();
  const auto call = [&](dParallelSAPOverlapCallback* callback) {
    dParallelSAPSpaceOverlaps(space, probes.data(), probes.size(), sizeof probes[0], 2, &nest,
                              callback);
  };
  call(ask);
  CHECK(nest.calls > 20);
  CHECK(nest.problem == "");
  REQUIRE_THROWS_AS(call([](void*, std::size_t, dGeomID, const dContactGeom*, int) { throw 1; }),
                    int);
  CHECK(wrongOverlaps(space, probes, 2, nest.owed) == "");
  dGeomSetPosition(world.geoms()[0], 1, 1, 1);  // not locked any more
}

TEST_CASE("Where there is no memory for a batch its probes are collided one by one", "[overlaps]") {
  const std::uint64_t seed = seedOr(551);
  Random random(seed);
  const Space space;
  World world(space);
  world.addBoxes(denseCube(300, seed));
  ProbeSet set(40, random);
  set.moveTo(world.geoms());
  world.take(createUserBox(space, {-1e3, 1e3, -1e3, 1e3, -1e3, 1e3}, false, failWithoutMemory));
  const std::vector<Contacts> owed = owedOverlaps(space, set.probes(), 3);
  for (const int threads : kTeams) {
    INFO(threads << " threads, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    dParallelSAPSpaceSetNumThreads(space, threads);
    memory_fails = true;
    REQUIRE(wrongOverlaps(space, set.probes(), 3, owed) == "");
    REQUIRE(!memory_fails);
  }
}

TEST_CASE("Overlaps are found in the program's floating-point mode, on every thread",
          "[overlaps]") {
  if (!FloatingPointMode::kCanBeSet) return;
  const std::uint64_t seed = seedOr(561);
  Random random(seed);
  const Space space;
  World world(space);
  world.addBoxes(denseCube(300, seed));
  ProbeSet set(40, random);
  set.moveTo(world.geoms());
  for (const unsigned mode : {FloatingPointMode::kUpward, FloatingPointMode::kFlushing})
    for (const int threads : kTeams) {
      dParallelSAPSpaceSetNumThreads(space, threads);
      const FloatingPointMode scoped(mode);
      const std::vector<Contacts> owed = owedOverlaps(space, set.probes(), 4);
      REQUIRE(wrongOverlaps(space, set.probes(), 4, owed) == "");
    }
}
