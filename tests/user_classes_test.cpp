// Which of the user's classes have an AABBTest: how the library comes to know, and what it does
// with it. These tests see ODE's private headers, and have all of its few classes to themselves.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdlib>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "space/geom/geom_tests.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/teams.h"

using namespace sap_test;
using ode_parallel_sap::foundUserClasses;
using ode_parallel_sap::testedClasses;

namespace {

using Calls = std::vector<std::pair<dGeomID, dGeomID>>;
Calls calls;
std::thread::id caller;
// Called whenever a geom of the user's is asked for its bounds.
void (*on_bounds)() = nullptr;

dColliderFn* noCollider(int) {
  return nullptr;
}

// A unit cube.
void bounds(dGeomID geom, dReal aabb[6]) {
  if (on_bounds) on_bounds();
  const dReal* const at = dGeomGetPosition(geom);
  for (int i = 0; i < 6; ++i) aabb[i] = at[i / 2] + (i % 2 ? dReal(0.5) : dReal(-0.5));
}

int agree(dGeomID self, dGeomID other, dReal[6]) {
  calls.push_back({self, other});
  if (caller != std::this_thread::get_id()) std::abort();
  return 1;
}

int refuse(dGeomID self, dGeomID other, dReal aabb[6]) {
  return agree(self, other, aabb) - 1;
}

// ODE's classes from its beginning on, of which there may be four.
class Classes {
 public:
  Classes() { reopen(); }
  ~Classes() { reopen(); }
  Classes(const Classes&) = delete;
  Classes& operator=(const Classes&) = delete;

  int create(dAABBTestFn* test) const {
    dGeomClass description = {};
    description.collider = noCollider;
    description.aabb = bounds;
    description.aabb_test = test;
    return dCreateGeomClass(&description);
  }

 private:
  void reopen() {
    dCloseODE();
    dInitODE2(0);
    dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
    calls.clear();
    caller = std::this_thread::get_id();
    on_bounds = nullptr;
  }
};

// More than a small scene.
constexpr std::size_t kGeoms = 400;

// Geoms of these classes in turn, thrown into a cube; class 0: spheres.
void fill(World& world, dSpaceID space, const std::vector<int>& classes) {
  Random random(seedOr(311));
  for (std::size_t i = 0; i < kGeoms; ++i) {
    const int of = classes[i % classes.size()];
    const dGeomID geom = of ? dCreateGeom(of) : dCreateSphere(nullptr, dReal(0.5));
    dSpaceAdd(space, geom);
    world.take(geom);
    const auto place = [&] { return static_cast<dReal>(random.between(0, 7)); };
    dGeomSetPosition(geom, place(), place(), place());
  }
}

// Those whose bounds touch, and no AABBTest of the program's refuses. (The tests' oracle has
// classes of its own.)
Pairs expectedOf(const World& world, int refusing = 0) {
  Pairs pairs;
  const std::vector<dGeomID>& geoms = world.geoms();
  const auto refuses = [&](dGeomID geom) { return refusing && dGeomGetClass(geom) == refusing; };
  for (std::size_t i = 0; i < geoms.size(); ++i)
    for (std::size_t j = i + 1; j < geoms.size(); ++j) {
      dReal a[6], b[6];
      dGeomGetAABB(geoms[i], a);
      dGeomGetAABB(geoms[j], b);
      bool touch = !refuses(geoms[i]) && !refuses(geoms[j]);
      for (int k = 0; k < 6; k += 2) touch = touch && a[k] <= b[k + 1] && b[k] <= a[k + 1];
      if (touch) pairs.push_back({i, j});
    }
  return pairs;
}

void moveAll(const World& world) {
  for (const dGeomID geom : world.geoms()) {
    const dReal* const at = dGeomGetPosition(geom);
    dGeomSetPosition(geom, at[0], at[1], at[2]);
  }
}

// Has the library find out: with such a grain the first frame is worth it.
void find(const Classes& classes) {
  const ScopedGrain grain(1);
  const Space space;
  World world(space);
  fill(world, space, {classes.create(nullptr)});
  (void)collide(space);
}

// What CTest's tests let go wrong, and what is told then.
const char* expectedWords() {
  static const std::vector<std::pair<std::string, const char*>> words = {
      {"static", "not a shared library"}, {"file", "cannot be read"},
      {"memory", "no room for files"},    {"load", "cannot be loaded"},
      {"contents", "not what its file"},  {"table", "table of colliders"}};
  const char* const fault = std::getenv("ODE_PARALLEL_SAP_TEST_IMAGE_FAULT");
  for (const auto& of : words)
    if (fault && of.first == fault) return of.second;
  return nullptr;
}

// The program's own class, in the table that was found.
dGeomClass& entryOf(int user_class) {
  return const_cast<dGeomClass&>(foundUserClasses()->classes[user_class - dFirstUserClass]);
}

// A class of C++ that calls itself one of the user's.
struct Pretender : dxGeom {
  explicit Pretender(int of) : dxGeom(nullptr, 1) { type = of; }
  void computeAABB() override { bounds(this, aabb); }
  int AABBTest(dxGeom* other, dReal box[6]) override { return refuse(this, other, box); }
};

}  // namespace

TEST_CASE("Who has few pairs of a user's class loads nothing for them") {
  REQUIRE_FALSE(foundUserClasses());  // no other test has had it found: this is the first
  const Classes classes;
  const Space space;
  World world(space);
  fill(world, space, {classes.create(nullptr)});
  for (int frame = 0; frame < 20; ++frame) (void)collide(space);
  CHECK_FALSE(foundUserClasses());
}

TEST_CASE("The table that is found is the one by which ODE calls") {
  const Classes classes;
  const int tested = classes.create(agree);
  find(classes);
  REQUIRE(foundUserClasses());
  const int plain = dFirstUserClass + 1;
  CHECK(testedClasses() == 1);
  for (const int of : {tested, plain}) {
    dGeomClass& entry = entryOf(of);
    CHECK(entry.aabb == bounds);
    CHECK(entry.collider == noCollider);
    // What is written there is what ODE does.
    const dGeomID geom = dCreateGeom(of);
    for (dAABBTestFn* const test : {refuse, entry.aabb_test}) {
      entry.aabb_test = test;
      CHECK(testedClasses() == (of == plain && test ? 1u + 2u : 1u));
      CHECK(geom->AABBTest(geom, geom->aabb) == (test == refuse ? 0 : 1));
    }
    dGeomDestroy(geom);
  }
  // No class was made but those two: the other two are the program's to make.
  CHECK(classes.create(refuse) == plain + 1);
  CHECK(classes.create(nullptr) == plain + 2);
  CHECK(testedClasses() == 1 + 4);
}

TEST_CASE("Geoms of a class without an AABBTest are not asked for one") {
  const Classes classes;
  find(classes);
  static int plain;
  plain = dFirstUserClass;
  for (const bool others : {false, true}) {
    const Space space;
    World world(space);
    fill(world, space, others ? std::vector<int>{plain, 0} : std::vector<int>{plain});
    const Pairs expected = expectedOf(world);
    REQUIRE(expected.size() > 400);
    for (int frame = 0; frame < 3; ++frame) {
      moveAll(world);
      // Between the decision and the filter an AABBTest appears, which anyone who asked would call.
      on_bounds = [] { entryOf(plain).aabb_test = refuse; };
      CHECK(difference(collide(space), expected) == "");
      CHECK(calls.empty());
      on_bounds = nullptr;
      // It is asked from the next frame on.
      CHECK(collide(space).empty() == !others);
      CHECK(!calls.empty());
      calls.clear();
      entryOf(plain).aabb_test = nullptr;
    }
  }
}

TEST_CASE("All threads look through pairs, unless a class has an AABBTest") {
  const Classes classes;
  find(classes);
  const int tested = classes.create(agree);
  const ScopedGrain grain(1);
  const auto shared = [] { return timesShared()["filter: verified pairs"]; };
  for (const int of : {dFirstUserClass + 0, tested}) {
    const Space space;
    dParallelSAPSpaceSetNumThreads(space, 3);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
    dParallelSAPSpaceSetSkipStatic(space, 1);  // what is looked through besides
    World world(space);
    fill(world, space, {of});
    for (std::size_t i = 0; i < kGeoms; i += 2) world.giveBody(world.geoms()[i]);
    const auto before = shared();
    CHECK(!collide(space).empty());
    CHECK((shared() > before) == (of != tested));
  }
}

TEST_CASE("An AABBTest is asked about the same pairs in the same order, whatever is known") {
  const Classes classes;
  const int tested = classes.create(agree), plain = classes.create(nullptr);
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    World world(space);
    fill(world, space, {tested, plain, 0});
    INFO(configuration.name);
    // As if nothing were known, and as it is.
    const auto* const known = foundUserClasses();
    ode_parallel_sap::user_classes = nullptr;
    const Pairs expected = collide(space);
    const Calls expected_calls = std::exchange(calls, {});
    REQUIRE(difference(expected, expectedOf(world)) == "");
    calls.clear();
    REQUIRE(expected_calls.size() > 200);
    ode_parallel_sap::user_classes = known;
    if (!known) find(classes);
    for (const bool moving : {true, false}) {
      if (moving) moveAll(world);
      CHECK(difference(collide(space), expected) == "");
      CHECK(std::exchange(calls, {}) == expected_calls);
    }
  }
}

TEST_CASE("Classes that are made later, or after ODE was closed, are known at once") {
  for (int round = 0; round < 2; ++round) {
    const Classes classes;
    if (round == 0) find(classes);
    const int plain = round == 0 ? dFirstUserClass : classes.create(nullptr);
    const Space space;
    World world(space);
    fill(world, space, {plain, 0});
    const Pairs expected = expectedOf(world);
    REQUIRE(difference(collide(space), expected) == "");
    // Little changes: the frame would be made of what is kept.
    const dGeomID late = dCreateGeom(classes.create(refuse));
    dSpaceAdd(space, late);
    setNumber(late, kGeoms);
    dGeomSetPosition(late, 3, 3, 3);
    calls.clear();
    CHECK(difference(collide(space), expected) == "");
    CHECK(!calls.empty());
    for (const auto& call : calls) CHECK(call.first == late);
    dGeomDestroy(late);
    CHECK(difference(collide(space), expected) == "");
  }
  // The numbers are those of other classes now.
  const Classes classes;
  const int refusing = classes.create(refuse);
  CHECK(refusing == dFirstUserClass);
  const Space space;
  World world(space);
  fill(world, space, {refusing});
  CHECK(collide(space).empty());
}

TEST_CASE("A geom of another C++ class is asked, whatever class it calls itself") {
  const Classes classes;
  find(classes);
  const Space space;
  World world(space);
  fill(world, space, {dFirstUserClass});
  const Pairs expected = expectedOf(world);
  const dGeomID pretender = new Pretender(dFirstUserClass);
  dSpaceAdd(space, pretender);
  setNumber(pretender, kGeoms);
  dGeomSetPosition(pretender, 3, 3, 3);
  CHECK(difference(collide(space), expected) == "");
  CHECK(!calls.empty());
  dGeomDestroy(pretender);
}

TEST_CASE("Where the table cannot be found all are asked, and it is said once", "[.fault]") {
  REQUIRE(expectedWords());
  const Classes classes;
  const Messages messages;
  const ScopedGrain grain(1);
  for (int round = 0; round < 2; ++round) {
    const Space space;
    World world(space);
    const int of = classes.create(round == 0 ? nullptr : refuse);
    fill(world, space, {of, 0});
    for (int frame = 0; frame < 3; ++frame) {
      moveAll(world);
      CHECK(difference(collide(space), expectedOf(world, round == 0 ? 0 : of)) == "");
    }
  }
  CHECK(!calls.empty());
  CHECK_FALSE(foundUserClasses());
  REQUIRE(messages.all().size() == 1);
  CHECK(messages.all()[0].find(expectedWords()) != std::string::npos);
}
