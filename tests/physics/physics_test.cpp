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
