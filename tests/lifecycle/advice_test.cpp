// What ODE_PARALLEL_SAP_STATS=1 says in its last line that options would leave out.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <cstdlib>
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
const std::string kLayers = "collide bits that keep categories 0x2 and 0x4 apart";

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

// The line about options of a space of this scene; empty if there is none.
std::string lineOf(const Populate& populate, Collide collide_once) {
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

// Takes the categories 2 and 4 apart.
void separateLayers(dSpaceID space, int) {
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) {
    const dGeomID geom = dSpaceGetGeom(space, i);
    const unsigned long category = dGeomGetCategoryBits(geom);
    dGeomSetCollideBits(geom, category == 2 ? ~4ul : category == 4 ? ~2ul : ~0ul);
  }
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
      const std::string line = lineOf(populate, collide_once);
      INFO(line);
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
      }
      CHECK(named > 0);
    }
}

TEST_CASE("Categories that never touch are named", "[advice]") {
  for (const std::vector<unsigned long>& categories :
       {std::vector<unsigned long>{2, 4}, {4, 2}, {2, 4, 2, 4, 8, 8}, {2, 4, 2}}) {
    const int count = categories.size() > 3 ? 900 : 600;
    const auto populate = [&](World& world) { addLayers(world, count, categories); };
    const std::string line = lineOf(populate, collideForContacts);
    INFO(categories.size() << " categories, first " << categories[0] << ": " << line);
    const double truth = shareOf(populate, separateLayers);
    CHECK(truth > 0.2);
    CHECK(std::fabs(saidOf(line, kLayers) - truth) < 0.006);
    CHECK(saidOf(lineOf(populate, collidePlainly), kLayers) == 0);  // nobody knows their contacts
  }
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
