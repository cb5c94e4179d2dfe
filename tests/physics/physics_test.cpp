// At every extreme of physics our pairs lead to what dSimpleSpace's lead to.
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "physics/extreme.h"
#include "support/bounds.h"
#include "support/catch.hpp"
#include "support/knobs.h"

using namespace sap_test;
using namespace sap_test::physics;

namespace {

// All extremes take minutes; physics-table plays them to their end.
double firstSteps(const Extreme& extreme) {
  return std::min(1.0, double(scaled(120)) / extreme.steps);
}

const Extreme& named(std::string_view name) {
  for (const Extreme& extreme : extremes()) {
    if (extreme.name == name) return extreme;
  }
  FAIL("no extreme is called " << name);
  return extremes()[0];
}

std::string outcomeOf(const std::string& name, const Setting& setting = {}) {
  return play(named(name), Pairing::ours, setting).outcome;
}

}  // namespace

TEST_CASE("At every physical extreme our pairs lead to the same bits as dSimpleSpace's") {
  CHECK(extremes().size() >= 40);
  for (const Extreme& extreme : extremes()) {
    const double length = firstSteps(extreme);
    const Result simple = play(extreme, Pairing::simple_in_our_order, {}, length);
    const Result ours = play(extreme, Pairing::ours, {}, length);
    INFO(extreme.theme << ": " << extreme.name << ": " << simple.outcome << " at step "
                       << simple.steps << ", with ours " << ours.outcome << " at step "
                       << ours.steps);
    CHECK(same(ours, simple));
    CHECK(ours.outcome != "crashes");
  }
}

TEST_CASE("Some physical extremes lead to the same bits to their end") {
  for (const char* name :
       {"a box on one as large, 1:10^4 of its mass", "a stack of 20",
        "boxes of 0.2 m at a plate of 0.1 m, 30 m/s", "a stack of 5, steps of 0.1 s",
        "a stack of 5, 1e+09 m away, moved there", "a stack of 5, 1e+09 m away, built there",
        "a chain of 20 links with a load of 1000 links",
        "a box about no axis of its own, 1000 rad/s, 1000 steps",
        "a stack of 5, denormals flushed"}) {
    INFO(name);
    CHECK(same(play(named(name), Pairing::ours, {}),
               play(named(name), Pairing::simple_in_our_order, {})));
  }
}

TEST_CASE("Outcomes are told apart by what is measured") {
  // In both precisions.
  CHECK(outcomeOf("a box on one as large, 1:10^6 of its mass") == "collapses");
  CHECK(!isWhatItOwes(outcomeOf("a stack of 5, steps of 0.1 s")));
  CHECK(outcomeOf("a stack of 5, steps of 0.001 s") == "stands");
  CHECK(outcomeOf("a chain of 20 links with a load of 1000 links") == "breaks");
  CHECK(outcomeOf("a pendulum of 1 m, steps of 0.001 s") == "holds");
  CHECK(outcomeOf("27 boxes in one place") == "explodes");
  CHECK(outcomeOf("a box on a mesh of one sheet") == "settles");
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
    const Extreme& extreme = named(name);
    INFO(name);
    CHECK(play(extreme, Pairing::simple_in_our_order, swept).outcome == "tunnels");
    CHECK(play(extreme, Pairing::hash, swept).outcome == "tunnels");
    CHECK(play(extreme, Pairing::ours, {}).outcome == "tunnels");
    CHECK(play(extreme, Pairing::ours, swept).outcome == "stops");
  }
}

TEST_CASE("A ball of 0.2 m at 200 m/s stops at a shelf of 50 mm, however it comes") {
  const auto at = [](double angle, const Vec& spin) {  // to the plumb line
    return [=](Stage& stage) {
      for (std::size_t i = 0; i < 8; ++i) {
        const double way = 3 + 0.25 * double(i), side = std::sin(angle), down = std::cos(angle);
        stage.ball({3.0 * double(i) - side * way, 0, down * way}, 0.1);
        stage.push(i, 200 * Vec{side, 0, -down});
        stage.spin(i, spin);
      }
    };
  };
  const auto slab = [](Stage& stage) { stage.block({0, 0, -0.025}, {400, 400, 0.05}); };
  const auto sheet = [](Stage& stage) {
    stage.mesh({-200, -200, 0, 200, -200, 0, 0, 400, 0}, {0, 1, 2});
  };
  using Build = std::function<void(Stage&)>;
  const std::vector<std::pair<Build, Build>> scenes = {
      {slab, at(0, {})},
      {slab, at(1, {})},
      {slab, at(0.5, {300, 200, 100})},
      {sheet, at(0.3, {})},
      {[](Stage& stage) {
         dBodySetKinematic(stage.box({0, 0, -0.025}, {400, 400, 0.05}));
       },
       at(0, {})},
      {slab, [](Stage& stage) {  // geoms beside their bodies' centres
         for (std::size_t i = 0; i < 8; ++i) {
           const dGeomID geom = stage.take(dCreateSphere(stage.space(), real(0.1)));
           dMass mass;
           dMassSetSphere(&mass, 1000, real(0.1));
           stage.body(geom, mass, {3.0 * double(i), 0, 3 + 0.25 * double(i)});
           dGeomSetOffsetPosition(geom, real(0.05), 0, real(-0.05));
           stage.push(i, {0, 0, -200});
         }
       }}};
  for (std::size_t i = 0; i < scenes.size(); ++i)
    for (const bool exact : {false, true}) {
      Extreme extreme{"", "", Demand::stop, [&](Stage& stage) {
                        scenes[i].second(stage);
                        scenes[i].first(stage);
                      }};
      extreme.steps = 100;
      extreme.lost = [](const Stage& stage, std::size_t body) {
        return body < 8 && (stage.place(body)[2] < 0 || stage.place(body)[2] > 3);
      };
      Setting setting;
      setting.exact = exact;
      INFO("scene " << i << (exact ? ", dWorldStep" : ""));
      CHECK(play(extreme, Pairing::hash, setting).outcome == "tunnels");
      setting.swept = true;
      CHECK(play(extreme, Pairing::ours, setting).outcome == "stops");
    }
}

namespace {

// A phase of the golden ratio: steps end at other places in each run.
double phaseOf(int run) {
  return run * 0.618033988749895 - std::floor(run * 0.618033988749895);
}

constexpr double kRadius = 0.1, kStep = 0.01;

// A ball of 0.2 m in no gravity, with swept contacts or with steps so many times smaller.
struct Flight : Stage {
  explicit Flight(const Setting& setting) : Stage(Pairing::ours, setting, kStep) {
    noGravity();
    friction = 0;
  }
  Vec speed(std::size_t body = 0) const { return vec(dBodyGetLinearVel((*this)[body])); }
  void fly(int steps) {
    for (; steps > 0; --steps) step();
  }
};

Setting sweptSetting() {
  Setting setting;
  setting.swept = true;
  return setting;
}

double quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[std::size_t(part * double(values.size() - 1))];
}

}  // namespace

TEST_CASE("Swept contacts keep a restitution of 0.8 at 0.6 to 10 diameters a step") {
  for (const double diameters : {0.6, 1.0, 2.0, 5.0, 10.0})
    for (int run = 0; run < 50; ++run) {
      const double speed = diameters * 2 * kRadius / kStep;
      Flight flight(sweptSetting());
      flight.surface = [](dContact& contact, dBodyID, dBodyID) {
        contact.surface.mode |= dContactBounce;
        contact.surface.bounce = real(0.8);
      };
      flight.block({3, 0, 0}, {1, 9, 9});
      flight.ball({phaseOf(run) - speed * kStep, 0, 0}, kRadius);
      flight.push(0, {speed, 0, 0});
      flight.fly(static_cast<int>(4 / (speed * kStep)) + 3);
      INFO(diameters << " diameters a step, run " << run);
      CHECK(-flight.speed()[0] / speed == Approx(0.8).epsilon(0.02));
    }
}

TEST_CASE("A ball that rolls over tiles hops no more often with swept contacts") {
  const auto hops = [](double speed, bool swept) {
    int count = 0;
    for (int run = 0; run < 40; ++run) {
      Setting setting;
      setting.swept = swept;
      Stage stage(Pairing::ours, setting, kStep);
      for (int i = -8; i < 80; ++i) stage.block({0.5 * i, 0, -0.05}, {0.5, 4, 0.1});
      stage.ball({phaseOf(run) - 0.5, 0.3, kRadius}, kRadius);
      stage.push(0, {speed, 0, 0});
      stage.spin(0, {0, speed / kRadius, 0});
      double top = 0;
      for (int i = 0; i < 30 / (speed * kStep); ++i) {
        stage.step();
        top = std::max(top, stage.place(0)[2] - kRadius);
      }
      count += top > 0.01;
    }
    return count;
  };
  for (const double speed : {12.0, 20.0, 40.0}) {
    INFO(speed << " m/s");
    CHECK(hops(speed, true) <= hops(speed, false));
  }
}

// The closed form: smooth balls that are inelastic along the line of their centres.
TEST_CASE("Two balls that meet in flight share the blow, and get no spin") {
  for (const double ratio : {1.0, 1000.0})
    for (const double diameters : {3.0, 10.0}) {
      const double speed = diameters * 2 * kRadius / kStep;
      std::vector<double> errors, spins;
      for (int run = 0; run < 60; ++run) {
        const double off = 0.24 * phaseOf(7 * run + 3) - 0.12;
        const double angle = 3.14159265 * (1 + run % 3) / 3;  // between their ways
        const double before = kStep * (0.3 + 2.7 * phaseOf(run));
        const Vec one = {speed, 0, 0}, two = {speed * std::cos(angle), speed * std::sin(angle), 0};
        const Vec relative = minus(one, two);
        const Vec across = off / length(relative) * Vec{-relative[1], relative[0], 0};
        const double along = std::sqrt(4 * kRadius * kRadius - off * off);
        const Vec normal = 1 / (2 * kRadius) * minus(-along / length(relative) * relative, across);
        Flight flight(sweptSetting());
        flight.ball(-before * one, kRadius);
        flight.push(0, one);
        flight.ball(minus(across, before * two), kRadius, 1000 * ratio);
        flight.push(1, two);
        if (length(minus(flight.place(0), flight.place(1))) < 2.1 * kRadius) continue;
        flight.fly(static_cast<int>(before / kStep) + 4);
        const double blow = dot(relative, normal) / (1 + 1 / ratio);
        const Vec expected = minus(one, blow * normal);
        errors.push_back(length(minus(flight.speed(), expected)) / std::fabs(blow));
        CHECK(length(minus(flight.speed(), one)) > 0.05 * std::fabs(blow));
        for (const std::size_t body : {0, 1})
          spins.push_back(length(vec(dBodyGetAngularVel(flight[body]))) * kRadius / speed);
      }
      INFO("1:" << ratio << ", " << diameters << " diameters a step");
      CHECK(quantile(errors, 0.5) < 0.1);
      CHECK(quantile(errors, 0.9) < 0.6);
      CHECK(quantile(spins, 0.9) < 0.05);
    }
}

// By the part of its speed that the ball has too much or lacks, against steps 400 times smaller. An
// elastic rebound from the depth of an impact is not counted.
TEST_CASE("Walls, holes, edges and rods act on a fast ball as they do in steps 400 times smaller") {
  struct Case {
    const char* name;
    double most;
    std::function<void(Flight&)> build;
  };
  const auto plates = [](Flight& flight) {  // five, with a square hole of 1.1 diameters each
    for (int i = 0; i < 5; ++i)
      for (const int side : {-1, 1}) {
        flight.block({0.7 * i, side * 1.11, 0}, {0.02, 2, 4});
        flight.block({0.7 * i, 0, side * 1.11}, {0.02, 0.22, 2});
      }
  };
  const auto shelves = [](Flight& flight) {
    for (int i = 0; i < 3; ++i) flight.block({0.3 * i, 0, 0}, {0.005, 4, 4});
  };
  const std::vector<Case> cases = {{"shelves of 5 mm", 1e-4, shelves},
                                   {"holes", 1e-4, plates},
                                   {"an edge, 2 mm clear", 1e-6,
                                    [](Flight& f) {
                                      f.block({0, 1.102, 0}, {0.5, 2, 4});
                                    }},
                                   {"an edge, 2 mm in", 0.25,
                                    [](Flight& f) {
                                      f.block({0, 1.098, 0}, {0.5, 2, 4});
                                    }},
                                   {"a post of 1 cm", 1e-6,
                                    [](Flight& f) {
                                      f.block({0, 0, 0}, {0.01, 0.01, 4});
                                    }},
                                   {"a post 2 mm clear", 1e-4, [](Flight& f) {
                                      f.block({0, 0.107, 0}, {0.01, 0.01, 4});
                                    }}};
  for (const Case& each : cases)
    for (const double speed : {50.0, 200.0, 400.0})
      for (int run = 0; run < 8; ++run) {
        const auto play = [&](const Setting& setting) {
          Flight flight(setting);
          each.build(flight);
          flight.ball({-1 - speed * kStep * phaseOf(run), 0, 0}, kRadius);
          flight.push(0, {speed, 0, 0});
          flight.fly(static_cast<int>(6 / (speed * kStep)) + 3);
          Vec found = flight.speed();
          found[0] = std::max(found[0], 0.0);
          return found;
        };
        Setting fine;
        fine.divide = 400;
        const double off = length(minus(play(sweptSetting()), play(fine))) / speed;
        INFO(each.name << ", " << speed << " m/s, run " << run);
        CHECK(off < each.most);
      }
}

TEST_CASE("A bat that turns by radians a step strikes a ball, and not one beyond its end") {
  for (const double rate : {100.0, 200.0, 300.0})
    for (const bool beyond : {false, true})
      for (int run = 0; run < 8; ++run) {
        Flight flight(sweptSetting());
        dBodySetKinematic(flight.box({0, 0, 0}, {2, 0.05, 0.05}));
        flight.turn(0, {0, 0, 1}, 6.28 * phaseOf(run));
        flight.spin(0, {0, 0, rate});
        const double distance = beyond ? 1.02 + kRadius + 0.001 : 0.8;
        flight.ball({distance, 0, 0}, kRadius);
        flight.fly(4);
        INFO(rate << " rad/s, beyond " << beyond << ", run " << run);
        CHECK((length(flight.speed(1)) > 1) == !beyond);
      }
}

namespace {

// How far a belt of 1 m/s along x carries a box in a second.
double carried(bool kinematic, bool belt_first) {
  Stage stage(Pairing::ours, {}, kStep);
  const auto belt = [&] {
    if (kinematic)
      dBodySetKinematic(stage.box({0, 0, -0.5}, {50, 2, 1}));
    else
      stage.block({0, 0, -0.5}, {50, 2, 1});
  };
  if (belt_first) belt();
  const dBodyID box = stage.box({0, 0, 0.5}, {1, 1, 1});
  if (!belt_first) belt();
  stage.surface = [](dContact& contact, dBodyID, dBodyID) {
    contact.surface.mode |= dContactMotion1 | dContactFDir1;
    contact.surface.motion1 = 1;
    contact.fdir1[0] = 1;
    contact.fdir1[1] = contact.fdir1[2] = 0;
  };
  for (int i = 0; i < 100; ++i) stage.step();
  return double(dBodyGetPosition(box)[0]);
}

}  // namespace

TEST_CASE("ODE's belts, kinematic floors and sleepers do what the guide says") {
  CHECK(carried(false, true) > 0.9);
  CHECK(carried(false, false) > 0.9);
  CHECK(carried(true, false) * carried(true, true) < -0.8);  // the order decides

  for (const bool kinematic : {false, true}) {
    Stage stage(Pairing::ours, {}, kStep);
    const dBodyID floor = kinematic ? stage.box({0, 0, -0.5}, {9, 9, 1}) : nullptr;
    if (floor) {
      dBodySetKinematic(floor);
    } else {
      stage.plane();
    }
    dWorldSetAutoDisableFlag(stage.world(), 1);
    const dBodyID box = stage.box({0, 0, 0.5}, {1, 1, 1});
    dBodySetAutoDisableFlag(box, 1);
    for (int i = 0; i < 300; ++i) stage.step();
    CHECK((dBodyIsEnabled(box) != 0) == kinematic);
    if (kinematic) continue;
    for (int i = 0; i < 10; ++i) {
      dBodyAddForce(box, 1, 0, 0);
      stage.step();
    }
    CHECK(double(dBodyGetForce(box)[0]) == Approx(10));
  }
}
