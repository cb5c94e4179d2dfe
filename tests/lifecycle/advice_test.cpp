// What ODE_PARALLEL_SAP_STATS=1 says in its last line that options would leave out.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
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

const std::string kStatic = "ODE_PARALLEL_SAP_SKIP_STATIC=1";
const std::string kAsleep = "ODE_PARALLEL_SAP_SKIP_ASLEEP=1";
const std::string kPlanes = "ODE_PARALLEL_SAP_CULL_PLANES=1";

using Populate = std::function<void(World&)>;
using Collide = void (*)(dSpaceID);

void collidePlainly(dSpaceID space) {
  (void)collide(space);
}
void collideBlocks(dSpaceID space) {
  dParallelSAPSpaceCollidePairs(space, nullptr, 0, nullptr);
}
void collideForContacts(dSpaceID space) {
  const auto ignore = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
  const dParallelSAPContactCallbacks callbacks = {ignore, nullptr, nullptr, nullptr};
  dParallelSAPSpaceCollideContacts(space, nullptr, 4, &callbacks);
}

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

// The line about options of a space of this scene; empty if there is none. `totals` gets the first.
std::string lineOf(const Populate& populate, Collide collide_once, std::string* totals = nullptr) {
  const Variable stats("ODE_PARALLEL_SAP_STATS", "1");
  const Messages messages;
  {
    const Space space;
    World world(space);
    populate(world);
    for (int frame = 0; frame < 3; ++frame) collide_once(space);
  }
  REQUIRE(!messages.all().empty());
  CHECK(messages.all().size() <= 2);
  if (totals) *totals = messages.all()[0];
  return messages.all().size() > 1 ? messages.all().back() : "";
}

// The part of the pairs that an option is said to leave out; 0 where it is not named.
double saidOf(const std::string& line, const std::string& option) {
  const std::string words = option + " would leave out ";
  const std::size_t at = line.find(words);
  return at == std::string::npos ? 0 : std::atof(line.c_str() + at + words.size()) / 100;
}

// What is true of the line: the part of the pairs that an option leaves out.
double shareOf(const Populate& populate, void (*set)(dSpaceID, int)) {
  const Space space;
  World world(space);
  populate(world);
  const double all = static_cast<double>(collide(space).size());
  set(space, 1);
  return 1 - static_cast<double>(collide(space).size()) / all;
}

}  // namespace

TEST_CASE("The part of the pairs that each option would leave out is named as it is", "[advice]") {
  const Populate populates[] = {[](World& world) {
                                  add(world, touchingLattice(300, 1), Bodies::none);
                                  add(world, denseCube(300, 2), Bodies::asleep, 100);
                                  add(world, denseCube(100, 3), Bodies::awake, 200);
                                },
                                [](World& world) {
                                  add(world, heap(500, 1), Bodies::asleep);
                                  addPlane(world, 1, 1, 1, -1000);
                                },
                                [](World& world) {
                                  add(world, denseCube(30, 1), Bodies::none);
                                  add(world, denseCube(30, 2), Bodies::awake, 100);
                                  addPlane(world, 0, 0, 1, -1000);
                                }};
  for (const Populate& populate : populates)
    for (Collide collide_once : {collidePlainly, collideBlocks, collideForContacts}) {
      std::string totals;
      const std::string line = lineOf(populate, collide_once, &totals);
      const auto msOf = [&](const char* what) {
        return std::atof(totals.c_str() + totals.find(what) + std::strlen(what));
      };
      const double by_pair = msOf("extract ") + msOf("filter ") + msOf("narrow ") + msOf("report ");
      INFO(totals << line);
      const struct {
        const std::string& option;
        void (*set)(dSpaceID, int);
      } options[] = {{kStatic, dParallelSAPSpaceSetSkipStatic},
                     {kAsleep, dParallelSAPSpaceSetSkipAsleep},
                     {kPlanes, dParallelSAPSpaceSetCullPlanes}};
      int named = 0;
      for (const auto& option : options) {
        const double share = shareOf(populate, option.set), said = saidOf(line, option.option);
        INFO(option.option << " leaves out " << share);
        CHECK(std::fabs(said - (share < 0.05 ? 0 : share)) < 0.006);
        named += said > 0;
        if (said == 0) continue;
        const std::string words = line.substr(line.find(option.option));
        CHECK(std::fabs(std::atof(words.c_str() + words.find("at most ") + 8) - share * by_pair) <
              0.1 * by_pair + 0.002);
      }
      CHECK(named > 0);
    }
}

TEST_CASE("What a program does not collide now is not advised to be kept apart", "[advice]") {
  const auto sleepersOnAShelf = [](World& world) {
    for (int i = 0; i < 150; ++i) {
      const dGeomID geom = world.take(dCreateBox(world.space(), 1, 1, 1));
      dGeomSetPosition(geom, dReal(i), 0, 1);
      dGeomSetCategoryBits(geom, 2);
      dBodyDisable(world.giveBody(geom));
    }
    const dGeomID shelf = world.take(dCreateBox(world.space(), 400, 1, 1));
    dGeomSetCategoryBits(shelf, 1);
  };
  const std::string line = lineOf(sleepersOnAShelf, [](dSpaceID space) {
    const auto ignore = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
    const auto leaveOut = [](void*, dGeomID, dGeomID) { return 0; };
    const dParallelSAPContactCallbacks callbacks = {ignore, leaveOut, nullptr, nullptr};
    dParallelSAPSpaceCollideContacts(space, nullptr, 4, &callbacks);
  });
  INFO(line);
  CHECK(saidOf(line, kAsleep) == 1);
  CHECK(line.find("apart") == std::string::npos);
}

TEST_CASE("Nothing is said where no option would leave out a pair", "[advice]") {
  const auto heapOfBodies = [](World& world) { add(world, heap(500, 1), Bodies::awake); };
  CHECK(lineOf(heapOfBodies, collidePlainly) == "");
  CHECK(lineOf(heapOfBodies, collideForContacts) == "");
  const auto rest = [](World& world) {
    add(world, denseCube(300, 1), Bodies::none);
    add(world, denseCube(300, 2), Bodies::asleep, 100);
    add(world, denseCube(300, 3), Bodies::awake, 200);
    addPlane(world, 1, 1, 1, -1000);
  };
  CHECK(lineOf(rest, [](dSpaceID space) {
          dParallelSAPSpaceSetSkipStatic(space, 1);
          dParallelSAPSpaceSetSkipAsleep(space, 1);
          dParallelSAPSpaceSetCullPlanes(space, 1);
          collidePlainly(space);
        }) == "");
}
