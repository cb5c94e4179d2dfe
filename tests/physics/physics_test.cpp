// At every extreme of physics our pairs lead to what dSimpleSpace's lead to.
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "physics/extreme.h"
#include "support/bounds.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/variable.h"

using namespace sap_test;
using namespace sap_test::physics;

namespace {

const Extreme& named(std::string_view name) {
  for (const Extreme& extreme : extremes())
    if (extreme.name == name) return extreme;
  FAIL("no extreme is called " << name);
  return extremes()[0];
}

std::string outcomeOf(const std::string& name, const Setting& setting = {},
                      Pairing pairing = Pairing::ours) {
  return play(named(name), pairing, setting).outcome;
}

}  // namespace

TEST_CASE("At every physical extreme our pairs lead to the same bits as dSimpleSpace's") {
  CHECK(extremes().size() >= 25);
  for (const Extreme& extreme : extremes()) {
    // All of them take minutes; physics-rows plays them to their end.
    const double length = std::min(1.0, double(scaled(120)) / extreme.steps);
    const Result simple = play(extreme, Pairing::simple_in_our_order, {}, length);
    const Result ours = play(extreme, Pairing::ours, {}, length);
    INFO(extreme.theme << ": " << extreme.name << ": " << simple.outcome << " at step "
                       << simple.steps << ", with ours " << ours.outcome << " at step "
                       << ours.steps);
    CHECK(same(ours, simple));
  }
}

TEST_CASE("Outcomes are told apart by what is measured") {
  // In both precisions.
  CHECK(outcomeOf("a box on one as large, 1:10^6 of its mass") == "collapses");
  CHECK(!isWhatItOwes(outcomeOf("a stack of 5, steps of 0.1 s")));
  CHECK(outcomeOf("a stack of 5, steps of 0.001 s") == "stands");
  Setting fine;
  fine.divide = 100;
  CHECK(outcomeOf("boxes of 0.2 m at a plate of 0.1 m, 100 m/s") == "tunnels");
  CHECK(outcomeOf("boxes of 0.2 m at a plate of 0.1 m, 100 m/s", fine) == "stops");
}

TEST_CASE("Starts are different") {
  Setting other;
  other.start = 3;
  const Extreme& extreme = named("a stack of 20");
  CHECK_FALSE(same(play(extreme, Pairing::ours, {}), play(extreme, Pairing::ours, other)));
}

TEST_CASE("What tunnels with stock spaces is stopped by swept contacts") {
  Setting swept;
  swept.swept = true;
  for (const char* name : {"boxes of 0.2 m at a plate of 0.1 m, 100 m/s",
                           "boxes of 0.2 m at a plate of 0.1 m, 1000 m/s",
                           "bullets of 10 mm at a plate of 10 mm, 900 m/s",
                           "two balls of 0.1 m head on, 100 m/s each"}) {
    INFO(name);
    CHECK(outcomeOf(name, swept, Pairing::simple_in_our_order) == "tunnels");
    CHECK(outcomeOf(name, swept, Pairing::hash) == "tunnels");
    CHECK(outcomeOf(name) == "tunnels");
    CHECK(outcomeOf(name, swept) == "stops");
  }
}

namespace {

// The guide's rows about ODE, in stages of 10 ms.
struct Odd : Stage {
  explicit Odd(const Things& things = {}) : Stage(Pairing::ours, {}, 0.01) { add(things); }
  void run(int steps) {
    for (; steps > 0; --steps) step();
  }
};

const Thing kCube = {Thing::box, {0, 0, 0.5}};

// How far a belt of 1 m/s along x carries a box in a second.
double carried(bool kinematic, bool belt_first) {
  Odd stage;
  const auto addBelt = [&] {
    stage.add({kinematic ? Thing::box : Thing::fixed, {0, 0, -0.5}, {50, 2, 1}});
    if (kinematic) dBodySetKinematic(stage.bodies().back());
  };
  if (belt_first) addBelt();
  const dBodyID box = stage.add(kCube);
  if (!belt_first) addBelt();
  stage.surface = [](dContact& contact) {
    contact.surface.mode |= dContactMotion1 | dContactFDir1;
    contact.surface.motion1 = 1;
    contact.fdir1[0] = 1;
    contact.fdir1[1] = contact.fdir1[2] = 0;
  };
  stage.run(100);
  return double(dBodyGetPosition(box)[0]);
}

// In how many of 200 places a capsule that lies on a grid of 2 m has no contact at an end, with
// room left for more.
int endsLost(int most) {
  Odd stage;
  addSheet(stage);
  const dGeomID mesh = dSpaceGetGeom(stage.space(), 0);
  const dGeomID capsule = stage.take(dCreateCapsule(stage.space(), real(0.2), 2));
  int lost = 0;
  for (int i = 0; i < 200; ++i) {
    const double x = 0.013 * i - 1.3, y = 0.009 * i - 0.9, angle = 0.37 * i;
    const Vec along = {std::cos(angle), std::sin(angle), 0};
    dMatrix3 rotation;
    dRFromZAxis(rotation, real(along[0]), real(along[1]), 0);
    dGeomSetRotation(capsule, rotation);
    dGeomSetPosition(capsule, real(x), real(y), real(0.19));
    std::vector<dContactGeom> found(64);
    const int n = dCollide(capsule, mesh, most, found.data(), sizeof(dContactGeom));
    bool ends[2] = {false, false};
    for (int k = 0; k < n; ++k) {
      const double at = dot(minus(vec(found[std::size_t(k)].pos), {x, y, 0}), along);
      if (std::fabs(at) > 0.7) ends[at > 0] = true;
    }
    lost += n < most && !(ends[0] && ends[1]);
  }
  return lost;
}

// How high a cube is after three seconds whose centre is 0.3 m beyond the end of its floor.
double heightBeyondTheEnd(bool heightfield) {
  static const double heights[121] = {};
  static const dHeightfieldDataID data = dGeomHeightfieldDataCreate();
  Odd stage;
  if (heightfield) {
    dGeomHeightfieldDataBuildDouble(data, heights, 0, 10, 10, 11, 11, 1, 0, 0, 0);
    dGeomHeightfieldDataSetBounds(data, 0, 0);
    dMatrix3 upright;
    dRFromAxisAndAngle(upright, 1, 0, 0, real(kPi / 2));
    dGeomSetRotation(stage.take(dCreateHeightfield(stage.space(), data, 1)), upright);
  } else {
    stage.add({Thing::fixed, {0, 0, -0.5}, {10, 10, 1}});
  }
  stage.add({Thing::box, {5.3, 0, 0.5}});
  stage.run(300);
  return stage.place(0)[2];
}

}  // namespace

TEST_CASE("ODE's belts, kinematic floors and sleepers do what the guide says") {
  CHECK(carried(false, true) > 0.9);
  CHECK(carried(false, false) > 0.9);
  CHECK(carried(true, false) * carried(true, true) < -0.8);  // the order decides

  enum Floor { geom, kinematic, dozing_kinematic };
  for (const Floor floor : {geom, kinematic, dozing_kinematic}) {
    const Variable stats("ODE_PARALLEL_SAP_STATS", "1");
    const Messages messages;
    {
      Odd stage({floor == geom ? Thing{Thing::plane} : Thing{Thing::box, {0, 0, -0.5}, {9, 9, 1}}});
      if (floor != geom) dBodySetKinematic(stage[0]);
      if (floor == dozing_kinematic) dBodySetAutoDisableFlag(stage[0], 1);
      dWorldSetAutoDisableFlag(stage.world(), 1);  // for the bodies that are made from now on
      const dBodyID box = stage.add(kCube);
      stage.run(300);
      CHECK((dBodyIsEnabled(box) != 0) == (floor == kinematic));
      for (int i = 0; i < 10 && floor == geom; ++i) {
        dBodyAddForce(box, 1, 0, 0);
        stage.step();
      }
      if (floor == geom) CHECK(double(dBodyGetForce(box)[0]) == Approx(10));
    }
    std::string said;
    for (const std::string& line : messages.all()) said += line;
    INFO(said);
    CHECK((said.find(" % of the pairs have a body at rest that an enabled kinematic body keeps "
                     "awake, so ODE_PARALLEL_SAP_SKIP_ASLEEP=1 leaves none of them out") !=
           std::string::npos) == (floor == kinematic));
  }
}

TEST_CASE("ODE's contacts of capsules and heightfields are as the guide says") {
  CHECK(endsLost(4) > 20);
  CHECK(endsLost(8) > 20);
  CHECK(endsLost(64) == 0);
  CHECK(heightBeyondTheEnd(true) == Approx(0.5).margin(0.01));
  CHECK(heightBeyondTheEnd(false) < -10);
}
