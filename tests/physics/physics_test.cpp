// At every extreme of physics our pairs lead to what dSimpleSpace's lead to.
#include <algorithm>
#include <string>

#include "physics/extreme.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/variable.h"

using namespace sap_test;
using namespace sap_test::physics;

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

TEST_CASE("A box sleeps on a floor unless that is an enabled kinematic body, and this is said") {
  enum Floor { geom, kinematic, dozing_kinematic };
  for (const Floor floor : {geom, kinematic, dozing_kinematic}) {
    const Variable stats("ODE_PARALLEL_SAP_STATS", "1");
    const Messages messages;
    {
      Stage stage(Pairing::ours, {}, 0.01);
      stage.add(floor == geom ? Thing{Thing::plane} : Thing{Thing::box, {0, 0, -0.5}, {9, 9, 1}});
      if (floor != geom) dBodySetKinematic(stage[0]);
      if (floor == dozing_kinematic) dBodySetAutoDisableFlag(stage[0], 1);
      dWorldSetAutoDisableFlag(stage.world(), 1);  // for the bodies that are made from now on
      const dBodyID box = stage.add(Thing{Thing::box, {0, 0, 0.5}});
      for (int i = 0; i < 300; ++i) stage.step();
      CHECK((dBodyIsEnabled(box) != 0) == (floor == kinematic));
    }
    std::string said;
    for (const std::string& line : messages.all()) said += line;
    INFO(said);
    CHECK((said.find(" % of the pairs have a body at rest that an enabled kinematic body keeps "
                     "awake, so ODE_PARALLEL_SAP_SKIP_ASLEEP=1 leaves none of them out") !=
           std::string::npos) == (floor == kinematic));
  }
}
