// What ODE_PARALLEL_SAP_STATS=1 says of geoms and pairs, and in its last line of options.
#include <cstdlib>
#include <cstring>
#include <functional>

#include "support/contact_scene.h"
#include "support/tests.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

const std::string kStatic = "ODE_PARALLEL_SAP_SKIP_STATIC=1";
const std::string kAsleep = "ODE_PARALLEL_SAP_SKIP_ASLEEP=1";
const std::string kPlanes = "ODE_PARALLEL_SAP_CULL_PLANES=1";

using Populate = std::function<void(World&)>;
using Collide = void (*)(dSpaceID);

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

void collidePlainly(dSpaceID space) {
  (void)collide(space);
}
void collideBlocks(dSpaceID space) {
  dParallelSAPSpaceCollidePairs(space, nullptr, 0, nullptr);
}
void collideForContacts(dSpaceID space) {
  (void)parallelContacts(space, 4);
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

// All that is said of a space in so many frames, before each of which `move` is called.
std::vector<std::string> linesOf(const Populate& populate, int frames,
                                 const std::function<void(int)>& move,
                                 Collide collide_once = collidePlainly) {
  const Variable stats("ODE_PARALLEL_SAP_STATS", "1");
  const Messages messages;
  {
    const Space space;
    World world(space);
    populate(world);
    for (int frame = 0; frame < frames; ++frame) {
      if (move) move(frame);
      collide_once(space);
    }
  }
  REQUIRE(!messages.all().empty());
  return messages.all();
}

// The line about options; empty if there is none. `totals` gets the first.
std::string optionsOf(const Populate& populate, Collide collide_once,
                      std::string* totals = nullptr) {
  const std::vector<std::string> lines = linesOf(populate, 3, nullptr, collide_once);
  CHECK(lines.size() <= 2);
  if (totals) *totals = lines[0];
  return lines.size() > 1 ? lines.back() : "";
}

// What is said of geoms.
std::string factsOf(const Populate& populate, int frames, const std::function<void(int)>& move) {
  std::string facts;
  for (const std::string& line : linesOf(populate, frames, move))
    if (!has(line, " frames (") && !has(line, "would leave") && !has(line, "dSpaceCollide2"))
      facts += line + "\n";
  return facts;
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

TEST_CASE("The part of the pairs that each option would leave out is named as it is", "[facts]") {
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
      const std::string line = optionsOf(populate, collide_once, &totals);
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

TEST_CASE("Nothing is said where no option would leave out a pair", "[facts]") {
  const auto heapOfBodies = [](World& world) { add(world, heap(500, 1), Bodies::awake); };
  CHECK(optionsOf(heapOfBodies, collidePlainly) == "");
  CHECK(optionsOf(heapOfBodies, collideForContacts) == "");
  const auto rest = [](World& world) {
    add(world, denseCube(300, 1), Bodies::none);
    add(world, denseCube(300, 2), Bodies::asleep, 100);
    add(world, denseCube(300, 3), Bodies::awake, 200);
    addPlane(world, 1, 1, 1, -1000);
  };
  CHECK(optionsOf(rest, [](dSpaceID space) {
          dParallelSAPSpaceSetSkipStatic(space, 1);
          dParallelSAPSpaceSetSkipAsleep(space, 1);
          dParallelSAPSpaceSetCullPlanes(space, 1);
          collidePlainly(space);
        }) == "");
}

namespace {

dSpaceID inTwoSpaces(dSpaceID parent) {
  return dHashSpaceCreate(dParallelSAPSpaceCreate(parent));
}
dSpaceID itself(dSpaceID space) {
  return space;
}

// Where a geom may be: in the space itself, or in one in it.
using Place = dSpaceID (*)(dSpaceID);
const Place kPlaces[] = {itself,
                         dParallelSAPSpaceCreate,
                         kStockSpaces[0].create,
                         kStockSpaces[1].create,
                         kStockSpaces[2].create,
                         kStockSpaces[3].create,
                         inTwoSpaces};

// How far a ball of 0.2 comes in a frame, as its body's velocity says or not.
struct Motion {
  double way;
  bool flies = false;
};
struct Flight {
  Place place;
  std::vector<Motion> motions;
  bool has_body = true;
  std::size_t others = 0;  // that move a little, in turn, so that stock spaces change their lists
  double step = 0;         // of swept bounds
  bool is_new = false;     // in each frame
};

std::string factsOf(const Flight& flight) {
  dGeomID ball = nullptr;
  dSpaceID own = nullptr;
  const dWorldID world = dWorldCreate();
  std::vector<dGeomID> others;
  const std::string facts = factsOf(
      [&](World& all) {
        own = flight.place(all.space());
        if (flight.step > 0) dParallelSAPSpaceSetSweptBounds(own, real(flight.step));
        while (others.size() < flight.others) others.push_back(dCreateBox(own, 1, 1, 1));
      },
      static_cast<int>(flight.motions.size()),
      [&, x = 0.0](int frame) mutable {
        const auto& [way, flies] = flight.motions[std::size_t(frame)];
        if (ball && flight.is_new) {
          dBodyDestroy(dGeomGetBody(ball));
          dGeomDestroy(ball);
        }
        if (frame == 0 || flight.is_new) {
          ball = dCreateSphere(own, real(0.1));
          if (flight.has_body) dGeomSetBody(ball, dBodyCreate(world));
        }
        if (flight.has_body)
          dBodySetLinearVel(dGeomGetBody(ball), real(flies ? 100 * way : 0), 0, 0);
        x += way;
        dGeomSetPosition(ball, real(x), 0, 0);
        for (std::size_t i = 0; i < others.size(); ++i)
          if (frame == 0 || (i + std::size_t(frame)) % 3 == 0)
            dGeomSetPosition(others[i], real(3 * double(i) + 0.01 * frame), 50, 0);
        // Queries between frames change nothing.
        const dGeomID probe = dCreateSphere(nullptr, 1);
        if (frame % 2) (void)collide2(own, probe);
        dGeomDestroy(probe);
      });
  dWorldDestroy(world);
  return facts;
}

}  // namespace

TEST_CASE("Geoms that move far for their size are named, in sub-spaces too", "[facts]") {
  const std::string moved = "up to 1 geoms at once moved by more than half of their smallest side";
  for (const Place place : kPlaces)
    for (const std::size_t others : {3, 200}) {
      const auto said = [&](const std::vector<Motion>& motions) {
        return factsOf({place, motions, false, others});
      };
      INFO(others << " others, place " << (&place - kPlaces));
      const std::string fast = said({{0}, {0.09}, {0.64}, {0}, {0.64}, {0.7}, {0.09}, {0.09}});
      INFO(fast);
      CHECK(has(fast,
                moved + " between frames and may pass through others; the worst moved 3.2 sides"));
      CHECK(has(fast, "; in 1 of 8 frames"));
      CHECK(said({{0}, {0.09}, {0.09}, {0.09}, {0.09}}) == "");
      // What is put elsewhere passes nothing.
      CHECK(said({{0}, {0.01}, {64}, {0.01}, {0.01}, {-64}, {64}, {0.01}}) == "");
    }
}

TEST_CASE("What its body's velocity leads far is named at once, and not what is put elsewhere",
          "[facts]") {
  for (const Place place : kPlaces) {
    INFO("place " << (&place - kPlaces));
    const std::string shot = factsOf({place, {{0, true}, {0.64, true}}});
    CHECK(has(shot, "may pass through others; the worst moved 3.2 sides"));
    CHECK(has(shot, "; in 1 of 2 frames"));
    CHECK(has(factsOf({place, {{0, true}, {0.64, true}, {-0.64, true}, {0.64, true}}}),
              "; in 3 of 4"));
    CHECK(factsOf({place, {{0}, {64}, {0}, {64}, {0}}}) == "");
  }
  CHECK(factsOf({itself, {{0}, {0.64}, {0.64}, {0.64}}, true, 0, 0, true}) == "");
  for (const Place place : {itself, Place(dParallelSAPSpaceCreate)}) {
    const std::vector<Motion> flight = {{0.64, true}, {0.64, true}, {0.64, true}};
    const auto said = [&](const std::vector<Motion>& motions, double step) {
      return factsOf({place, motions, true, 0, step});
    };
    CHECK(has(said(flight, 0.01), "which swept bounds cover; the worst moved 3.2"));
    // They are for a shorter step than a frame.
    CHECK(has(said(flight, 0.005), "may pass through others; the worst moved 3.2"));
    // Its swept box grows by metres with its speed.
    CHECK(said({{0.01, true}, {0.03, true}, {0.06, true}, {0.09, true}}, 1) == "");
  }
}

TEST_CASE("Geoms that come and go are not taken for those that move", "[facts]") {
  std::vector<dGeomID> shots;
  dSpaceID inner = nullptr;
  const std::string said = factsOf(
      [&](World& world) {
        world.addBoxes(denseCube(100, 1));
        inner = dHashSpaceCreate(world.space());
      },
      60,
      [&](int frame) {
        for (const dGeomID shot : shots)
          dGeomSetPosition(shot, dGeomGetPosition(shot)[0] + dReal(0.01), 0, 100);
        if (shots.size() > 5) {
          dGeomDestroy(shots.front());
          shots.erase(shots.begin());
        }
        shots.push_back(dCreateSphere(inner, dReal(0.1)));
        dGeomSetPosition(shots.back(), dReal(100 * (frame % 7)), 0, 100);
      });
  CHECK(said == "");
}

TEST_CASE("Geoms too far for dReal and those with NaN are named, in sub-spaces too", "[facts]") {
  const double step = static_cast<double>(std::numeric_limits<dReal>::epsilon());
  for (const Place place : kPlaces) {
    INFO("place " << (&place - kPlaces));
    const auto said = [&](double far, bool nan, bool disabled = false) {
      return factsOf(
          [&](World& world) {
            const dSpaceID own = place(world.space());
            for (int i = 0; i < 5; ++i)
              dGeomSetPosition(dCreateBox(own, 1, 2, 3), dReal(i < 2 ? far : 0), dReal(5 * i), 0);
            if (!nan) return;
            const dGeomID sick = dCreateSphere(own, 1);
            dGeomSetPosition(sick, std::numeric_limits<dReal>::quiet_NaN(), 0, 0);
            if (disabled) dGeomDisable(sick);
          },
          3, nullptr);
    };
    CHECK(said(1.0 / 520 / step, false) == "");
    const std::string far = said(1.0 / 100 / step, false);
    INFO(far);
    CHECK(has(far,
              "up to 2 geoms at once are so far from the origin that a step of dReal is more "
              "than 1/512 of their smallest side; at the worst 0.01 sides"));
    CHECK(has(far, "; in 3 of 3 frames"));
    CHECK(has(said(0, true), "up to 1 geoms at once had NaN bounds and were in no pair"));
    CHECK(said(0, true, true) == "");
  }
}

TEST_CASE("Static geoms that touch nothing are named where the update reads them", "[facts]") {
  Place place = itself;
  const Populate shelves = [&place](World& world) {
    const dSpaceID own = place(world.space());
    for (int i = 0; i < 20000; ++i)
      dGeomSetPosition(dCreateBox(own, 1, 1, 1), dReal(3 * (i % 200)), dReal(3 * (i / 200)), 0);
    const dGeomID geom = world.take(dCreateBox(world.space(), 1, 1, 1));
    dGeomSetPosition(geom, 0, 0, 50);
    world.giveBody(geom);
  };
  const std::string words =
      "ODE_PARALLEL_SAP_SKIP_STATIC=1 would leave out 100 % of the geoms from the update "
      "(without a body), at most ";
  // Other programs may take the processor during another stage, once or twice.
  bool named = false;
  for (int i = 0; i < 5 && !named; ++i) named = has(optionsOf(shelves, collidePlainly), words);
  CHECK(named);
  CHECK(optionsOf(shelves, [](dSpaceID space) {
          dParallelSAPSpaceSetSkipStatic(space, 1);
          collidePlainly(space);
        }) == "");
  // Not those that the program moves.
  const std::string moving = optionsOf(shelves, [](dSpaceID space) {
    for (int i = 0; i < 20000; ++i) {
      const dGeomID geom = dSpaceGetGeom(space, i);
      moveBy(geom, 0.1, 0, 0);
    }
    collidePlainly(space);
  });
  CHECK(!has(moving, "100 % of the geoms"));
  // The option of a space is not that of its sub-spaces.
  place = dSimpleSpaceCreate;
  const Populate beside = [&shelves](World& world) {
    shelves(world);
    for (int i = 0; i < 300; ++i)
      dBodySetPosition(world.giveBody(world.take(dCreateBox(world.space(), 1, 1, 1))), dReal(3 * i),
                       0, 90);
  };
  const std::string nested = optionsOf(beside, [](dSpaceID space) {
    for (int i = 0; i < dSpaceGetNumGeoms(space); ++i)
      if (const dBodyID body = dGeomGetBody(dSpaceGetGeom(space, i)))
        dBodySetPosition(body, dBodyGetPosition(body)[0] + dReal(0.01), 0, 90);
    collidePlainly(space);
  });
  INFO(nested);
  CHECK(!has(nested, "of the geoms from the update"));
}
