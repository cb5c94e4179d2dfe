// Spaces that are told of what ODE does not tell: the pairs are the same, and what is not told is
// not looked for.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/rules_oracle.h"
#include "support/scenes.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

const char* const kNotified = "ODE_PARALLEL_SAP_NOTIFIED";

// Boxes that overlap in a row, the first of which may be changed.
struct Row {
  Row() {
    constexpr int boxes = 300;
    for (int i = 0; i < boxes; ++i) world.addBox({{0.8 * i, 0, 0}, {0.8 * i + 1, 1, 1}});
    for (const dGeomID geom : world.geoms()) world.giveBody(geom);
    pairs = collide(space);
    REQUIRE(pairs.size() == boxes - 1);
  }
  dGeomID geom() const { return world.geoms()[0]; }
  dBodyID body() const { return world.bodies()[0]; }

  Space space;
  World world{space};
  Pairs pairs;
};

// A world without gravity in which bodies fall asleep at once, and couples of them hang together.
class SteppedScene {
 public:
  explicit SteppedScene(std::uint64_t seed) : random_(seed) {
    world_.addBoxes(denseCube(300, seed));
    dWorldSetAutoDisableFlag(world_.dynamics(), 1);
    dWorldSetAutoDisableSteps(world_.dynamics(), 2);
    dWorldSetAutoDisableTime(world_.dynamics(), 0);
    for (const dGeomID geom : world_.geoms())
      if (random_.chance(0.8)) world_.giveBody(geom);
    // A body without a joint never sleeps.
    for (const dBodyID body : world_.bodies())
      dJointAttach(dJointCreateLMotor(world_.dynamics(), nullptr), body, nullptr);
    for (std::size_t i = 0; i + 1 < world_.bodies().size(); i += 2)
      if (random_.chance(0.5)) join(world_.bodies()[i], world_.bodies()[i + 1]);
  }
  dSpaceID space() const { return space_; }

  // A few bodies are woken and pushed, of which the space is told, others stopped; the step does
  // the rest.
  void step() {
    for (const dBodyID body : world_.bodies())
      if (random_.chance(0.8)) stop(body);
    for (int i = 0; i < 3 && random_.chance(0.5); ++i) {
      const dBodyID body = world_.bodies()[random_.below(world_.bodies().size())];
      dBodyEnable(body);
      dBodySetLinearVel(body, random_.between(-9, 9), random_.between(-9, 9), 0);
      dParallelSAPSpaceNotify(space_, dBodyGetFirstGeom(body));
    }
    dWorldQuickStep(world_.dynamics(), 0.02);
  }
  std::size_t asleep() const {
    std::size_t asleep = 0;
    for (const dBodyID body : world_.bodies()) asleep += !dBodyIsEnabled(body);
    return asleep;
  }
  std::string wrong(const Pairs& pairs) const {
    return wrongByRules(Rules::of(space_), world_.geoms(), pairs);
  }

 private:
  void join(dBodyID a, dBodyID b) {
    const dReal* const at = dBodyGetPosition(a);
    const dJointID joint = dJointCreateBall(world_.dynamics(), nullptr);
    dJointAttach(joint, a, b);
    dJointSetBallAnchor(joint, at[0], at[1], at[2]);
  }
  static void stop(dBodyID body) {
    dBodySetLinearVel(body, 0, 0, 0);
    dBodySetAngularVel(body, 0, 0, 0);
  }

  Space space_;
  World world_{space_};
  Random random_;
};

}  // namespace

TEST_CASE("Of bodies that a step puts to sleep or wakes nobody need tell", "[notified]") {
  const BareEnvironment bare;
  const std::uint64_t seed = seedOr(64);
  for (const bool skip_static : {false, true}) {
    SteppedScene scene(seed);
    dParallelSAPSpaceSetSkipAsleep(scene.space(), 1);
    dParallelSAPSpaceSetSkipStatic(scene.space(), skip_static);
    dParallelSAPSpaceSetNotified(scene.space(), 1);
    int changes = 0, few = 0;
    std::size_t asleep = 0;
    for (int frame = 0; frame < scaled(200); ++frame) {
      INFO("seed " << seed << ", skip static " << skip_static << ", frame " << frame);
      REQUIRE(scene.wrong(collide(scene.space())) == "");
      changes += scene.asleep() != asleep;
      asleep = scene.asleep();
      few += statsOf(scene.space()).moved < 30;
      scene.step();
    }
    CHECK(changes > scaled(200) / 10);
    CHECK(few > scaled(200) / 10);
  }
}

TEST_CASE("A frame reads only geoms that were announced", "[notified]") {
  const BareEnvironment bare;
  for (const bool all : {false, true}) {
    Row row;
    dParallelSAPSpaceSetNotified(row.space, 1);
    CHECK(collide(row.space) == row.pairs);
    dGeomDisable(row.geom());
    CHECK(collide(row.space) == row.pairs);  // a broken promise
    dParallelSAPSpaceNotify(row.space, all ? nullptr : row.geom());
    CHECK(collide(row.space).size() == row.pairs.size() - 1);
    CHECK(statsOf(row.space).kept > 0);
    CHECK(statsOf(row.space).disabled == 1);
    dGeomEnable(row.geom());
    CHECK(collide(row.space).size() == row.pairs.size() - 1);
    dParallelSAPSpaceSetNotified(row.space, 0);
    CHECK(collide(row.space) == row.pairs);
  }
}

TEST_CASE("A change announced in a callback counts in the next collide", "[notified]") {
  const BareEnvironment bare;
  Row row;
  dParallelSAPSpaceSetNotified(row.space, 1);
  (void)collide(row.space);
  dSpaceCollide(row.space, &row, [](void* data, dGeomID, dGeomID) {
    Row& row = *static_cast<Row*>(data);
    dGeomDisable(row.geom());
    dParallelSAPSpaceNotify(row.space, row.geom());
  });
  CHECK(collide(row.space).size() == row.pairs.size() - 1);
}

TEST_CASE("Many threads may tell of geoms at once", "[notified]") {
  const BareEnvironment bare;
  Row row;
  dParallelSAPSpaceSetNotified(row.space, 1);
  (void)collide(row.space);
  const std::vector<dGeomID>& geoms = row.world.geoms();
  constexpr std::size_t team = 4;
  for (int frame = 0; frame < scaled(50); ++frame) {
    std::vector<std::thread> threads;
    for (std::size_t thread = 0; thread < team; ++thread)
      threads.emplace_back([&, thread] {
        for (std::size_t i = thread; i < geoms.size() / 17; i += team) {
          dGeomIsEnabled(geoms[i]) ? dGeomDisable(geoms[i]) : dGeomEnable(geoms[i]);
          dParallelSAPSpaceNotify(row.space, geoms[i]);
        }
      });
    for (std::thread& thread : threads) thread.join();
    REQUIRE(difference(collide(row.space), expectedPairs(geoms)) == "");
    REQUIRE(statsOf(row.space).kept > 0);
  }
}

TEST_CASE("A promise that is not kept is found out on demand, and harms no pair", "[notified]") {
  const BareEnvironment bare;
  using Change = void (*)(Row & row);
  const std::pair<const char*, Change> changes[] = {
      {"category", [](Row& row) { dGeomSetCategoryBits(row.geom(), 0); }},
      {"collide", [](Row& row) { dGeomSetCollideBits(row.geom(), 2); }},
      {"disabled", [](Row& row) { dGeomDisable(row.geom()); }},
      {"no body", [](Row& row) { dGeomSetBody(row.geom(), nullptr); }},
      {"asleep", [](Row& row) { dBodyDisable(row.body()); }},
      {"told", [](Row& row) {
         dGeomDisable(row.geom());
         dParallelSAPSpaceNotify(row.space, row.geom());
       }}};
  for (const bool checked : {false, true})
    for (const auto& [name, change] : changes) {
      const Variable variable(kNotified, checked ? "check" : nullptr);
      INFO(name << ", checked " << checked);
      Row row;
      CHECK(dParallelSAPSpaceGetNotified(row.space) == 0);
      dParallelSAPSpaceSetNotified(row.space, 1);
      dParallelSAPSpaceSetSkipAsleep(row.space, 1);
      (void)collide(row.space);
      const Messages messages;
      change(row);
      const Pairs pairs = collide(row.space);
      (void)collide(row.space);
      const bool kept = std::string("asleep told").find(name) != std::string::npos;
      if (checked || kept) CHECK(difference(pairs, expectedPairs(row.world.geoms())) == "");
      REQUIRE(messages.all().size() == (checked && !kept ? 1 : 0));
      if (messages.all().empty()) continue;
      CHECK(messages.all()[0].find("1 geoms changed, geom ") != std::string::npos);
      dGeomSetCategoryBits(row.geom(), 5);
      (void)collide(row.space);
      CHECK(messages.all().size() == 1);  // once is enough
    }
}
