// Spaces that are told of what ODE does not tell: the pairs are the same, and what is not told is
// not looked for.
#include "support/tests.h"
#include "support/together.h"
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

}  // namespace

TEST_CASE("A frame reads only geoms that were announced, in callbacks or between", "[notified]") {
  const BareEnvironment bare;
  enum { all, one, in_callback };
  for (const int way : {all, one, in_callback}) {
    Row row;
    dParallelSAPSpaceSetNotified(row.space, 1);
    CHECK(collide(row.space) == row.pairs);
    dGeomDisable(row.geom());
    CHECK(collide(row.space) == row.pairs);  // a broken promise
    if (way == in_callback)
      collide(row.space, [&](dGeomID, dGeomID) { dParallelSAPSpaceNotify(row.space, row.geom()); });
    else
      dParallelSAPSpaceNotify(row.space, way == all ? nullptr : row.geom());
    CHECK(collide(row.space).size() == row.pairs.size() - 1);
    CHECK(statsOf(row.space).kept > 0);
    CHECK(statsOf(row.space).disabled == 1);
    dGeomEnable(row.geom());
    CHECK(collide(row.space).size() == row.pairs.size() - 1);
    dParallelSAPSpaceSetNotified(row.space, 0);
    CHECK(collide(row.space) == row.pairs);
  }
}

TEST_CASE("Many threads may tell of geoms at once", "[notified]") {
  const BareEnvironment bare;
  Row row;
  dParallelSAPSpaceSetNotified(row.space, 1);
  (void)collide(row.space);
  const std::vector<dGeomID>& geoms = row.world.geoms();
  constexpr int team = 4;
  for (int frame = 0; frame < scaled(50); ++frame) {
    together(team, [&](int thread) {
      for (std::size_t i = thread; i < geoms.size() / 17; i += team) {
        dGeomIsEnabled(geoms[i]) ? dGeomDisable(geoms[i]) : dGeomEnable(geoms[i]);
        dParallelSAPSpaceNotify(row.space, geoms[i]);
      }
    });
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
    for (const bool skips : {false, true})
      for (const auto& [name, change] : changes) {
        const Variable variable(kNotified, checked ? "check" : nullptr);
        INFO(name << ", checked " << checked << ", skips " << skips);
        Row row;
        CHECK(dParallelSAPSpaceGetNotified(row.space) == 0);
        dParallelSAPSpaceSetNotified(row.space, 1);
        dParallelSAPSpaceSetSkipAsleep(row.space, skips);
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
