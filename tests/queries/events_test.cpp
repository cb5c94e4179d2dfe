// Which pairs began and ended, and their numbers, held against a map of all pairs.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/events_oracle.h"
#include "support/knobs.h"
#include "support/moving_scene.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/rules_oracle.h"
#include "support/sanitizers.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

Pairs asPairs(const Events& events) {
  Pairs pairs;
  for (const Event& event : events)
    pairs.emplace_back(event.o1 ? number(event.o1) : 0, event.o2 ? number(event.o2) : 0);
  return pairs;
}

// What a space with events is set to on the way: other ways to find the same pairs, and rules by
// which there are others.
void settle(dSpaceID space, Random& random) {
  const int threads[] = {1, 2, 3, 7};
  dParallelSAPSpaceSetNumThreads(space, threads[random.below(4)]);
  dParallelSAPSpaceSetSkipStatic(space, random.chance(0.3));
  dParallelSAPSpaceSetSkipAsleep(space, random.chance(0.3));
  dParallelSAPSpaceSetMethod(space, static_cast<int>(random.below(3)));
  dParallelSAPSpaceSetNotified(space, random.chance(0.5));
}

Pairs owedBy(const MovingScene& scene) {
  const Rules rules = Rules::of(scene.space());
  const EventsOracle::Geoms geoms = EventsOracle::byNumber(scene.order());
  Pairs pairs;
  for (const Pair& pair : expectedPairs(scene.order()))
    if (restOf(rules, geoms.at(pair.first), geoms.at(pair.second)) == Rest::no)
      pairs.push_back(pair);
  return pairs;
}

Pairs pairsOfBlocks(dSpaceID space) {
  Pairs pairs;
  dParallelSAPSpaceCollidePairs(
      space, &pairs, 0,
      [](void* all, const dParallelSAPPair* some, std::size_t count, std::size_t) {
        for (std::size_t i = 0; i < count; ++i) record(all, some[i].o1, some[i].o2);
      });
  return pairs;
}

// A frame of one of the kinds that there are; what is wrong of it.
std::string wrongFrame(MovingScene& scene, EventsOracle& oracle, std::size_t kind, Random& random) {
  const dSpaceID space = scene.space();
  dParallelSAPContactCallbacks callbacks = {};
  callbacks.contacts = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
  callbacks.flags = [](void*, dGeomID, dGeomID) { return 0; };  // nothing is collided
  Pairs pairs;
  switch (kind) {
    case 0:
      collideUntil(space, 1);
      pairs = owedBy(scene);
      break;
    case 2:
      dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
      pairs = owedBy(scene);
      break;
    case 3:
      pairs = pairsOfBlocks(space);
      break;
    case 4:
      for (std::size_t again = random.below(4); again > 0; --again) {
        dParallelSAPSpaceCollidePairs(space, nullptr, 0, nullptr);
        const std::string problem =
            oracle.check(space, owedBy(scene), EventsOracle::byNumber(scene.order()));
        if (problem != "") return problem;
      }
      dParallelSAPSpaceCollidePairs(space, nullptr,
                                    random.chance(0.5) ? dParallelSAPPairsConcurrent : 0, nullptr);
      pairs = owedBy(scene);
      if (statsOf(space).pairs != pairs.size()) return "without a callback not all are counted";
      break;
    default:
      pairs = collide(space);
  }
  return oracle.check(space, pairs, EventsOracle::byNumber(scene.order()));
}

}  // namespace

TEST_CASE("Begun and ended pairs and their numbers are those of a map of all pairs", "[events]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t geoms : {10, 100, 130, 700}) {
      const std::uint64_t seed = seedOr(401);
      Random random(seed);
      MovingScene scene(configuration, geoms, seed);
      EventsOracle oracle;
      dParallelSAPSpaceSetEvents(scene.space(), 1);
      scene.promise();
      const int frames = scaled(geoms > 500 ? 150 : 400);
      for (int frame = 0; frame < frames; ++frame) {
        // Often nothing, at times a third of all.
        const std::size_t edits = random.chance(0.4) ? 0 : 1 + random.below(5),
                          kind = random.below(8);
        for (std::size_t i = random.chance(0.05) ? geoms / 3 : edits; i > 0; --i) scene.edit();
        if (random.chance(0.1)) settle(scene.space(), random);
        const std::string problem = wrongFrame(scene, oracle, kind, random);
        INFO(configuration.name << ", " << geoms << " geoms, frame " << frame << " of kind " << kind
                                << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        REQUIRE(problem == "");
      }
      CHECK(oracle.begun() > static_cast<std::size_t>(frames / 2));
      CHECK(oracle.ended() > static_cast<std::size_t>(frames / 2));
    }
}

TEST_CASE("A scene at rest has no events, and all numbers stay", "[events]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {50, 3000}) {
      const Space space(configuration);
      World world(space);
      world.addBoxes(denseCube(geomsOf(n), seedOr(403)));
      (void)collide(space);
      CHECK(begunOf(space).empty());
      CHECK(numbersOf(space).empty());
      dParallelSAPSpaceSetEvents(space, 1);
      REQUIRE(dParallelSAPSpaceGetEvents(space) == 1);
      const Pairs pairs = collide(space);
      INFO(configuration.name << ", " << n << " geoms");
      REQUIRE(asPairs(begunOf(space)) == pairs);
      const std::vector<unsigned> numbers = numbersOf(space);
      for (std::size_t i = 0; i < numbers.size(); ++i) REQUIRE(numbers[i] == i);
      for (int frame = 0; frame < 6; ++frame) {
        REQUIRE(collide(space) == pairs);
        REQUIRE(begunOf(space).empty());
        REQUIRE(endedOf(space).empty());
        REQUIRE(numbersOf(space) == numbers);
      }
      // Off, nothing is told; on again, all begin.
      dParallelSAPSpaceSetEvents(space, 0);
      CHECK(numbersOf(space).empty());
      (void)collide(space);
      CHECK(endedOf(space).empty());
      dParallelSAPSpaceSetEvents(space, 1);
      (void)collide(space);
      CHECK(asPairs(begunOf(space)) == pairs);
      CHECK(numbersOf(space) == numbers);
    }
}

TEST_CASE("A pair that only a frame of another method left out ends and begins", "[events]") {
  for (const int first : {dParallelSAPMethodAuto, dParallelSAPMethodSweep}) {
    const Space space;
    dParallelSAPSpaceSetEvents(space, 1);
    const dGeomID geoms[] = {dCreateSphere(space, 1), dCreateSphere(space, 1)};
    const auto collideBy = [&](int method, bool pair) {
      dGeomSetCategoryBits(geoms[0], pair ? ~0ul : 0);
      dGeomSetCollideBits(geoms[0], pair ? ~0ul : 0);
      dParallelSAPSpaceSetMethod(space, method);
      REQUIRE(collide(space).size() == pair);
    };
    for (int frame = 0; frame < 3; ++frame) collideBy(first, true);
    CHECK(begunOf(space).empty());
    collideBy(dParallelSAPMethodAuto + dParallelSAPMethodSweep - first, false);
    CHECK(endedOf(space).size() == 1);
    collideBy(first, true);
    INFO("method " << first);
    CHECK(begunOf(space).size() == 1);
  }
}

TEST_CASE("An ended pair names no geom that has left the space", "[events]") {
  for (const bool small : {true, false}) {
    const Space space, other;
    if (!small) dParallelSAPSpaceSetMethod(space, dParallelSAPMethodSweep);
    dParallelSAPSpaceSetEvents(space, 1);
    std::vector<dGeomID> geoms;
    for (int i = 0; i < 6; ++i) {
      geoms.push_back(dCreateSphere(space, 1));
      dGeomSetPosition(geoms.back(), dReal(1.5) * i, 0, 0);
    }
    (void)collide(space);
    CHECK(begunOf(space).size() == 5);
    dGeomDestroy(geoms[0]);         // 0-1
    dSpaceRemove(space, geoms[2]);  // 1-2, 2-3
    dSpaceAdd(other, geoms[2]);
    dGeomSetPosition(geoms[5], 100, 0, 0);  // 4-5
    (void)collide(space);
    INFO("small: " << small);
    CHECK(endedOf(space) == Events{{nullptr, geoms[1], 0, 0},
                                   {geoms[1], nullptr, 1, 1},
                                   {nullptr, geoms[3], 2, 2},
                                   {geoms[4], geoms[5], 4, 4}});
    // The numbers of the ended are taken in the frame after, the lowest first.
    dSpaceRemove(other, geoms[2]);
    dSpaceAdd(space, geoms[2]);
    (void)collide(space);
    CHECK(begunOf(space) == Events{{geoms[1], geoms[2], 0, 0}, {geoms[3], geoms[2], 2, 1}});
    // Removed and added again in between: ended and begun.
    dSpaceRemove(space, geoms[2]);
    dSpaceAdd(space, geoms[2]);
    (void)collide(space);
    CHECK(endedOf(space) == Events{{geoms[1], nullptr, 0, 0}, {geoms[3], nullptr, 2, 1}});
    CHECK(begunOf(space) == Events{{geoms[1], geoms[2], 0, 2}, {geoms[3], geoms[2], 2, 4}});
    unsigned number = 77;
    CHECK(dParallelSAPSpaceFindPair(space, geoms[2], geoms[3], &number) == 1);
    CHECK(number == 4);
    CHECK(dParallelSAPSpaceFindPair(space, geoms[1], geoms[3], &number) == 0);
    const dGeomID stranger = dCreateSphere(other, 1);
    CHECK(dParallelSAPSpaceFindPair(space, geoms[1], stranger, &number) == 0);
    CHECK(number == 4);
  }
}

TEST_CASE("Events are known before the first pair is, and stay when the callback throws",
          "[events]") {
  for (const std::size_t n : {60, 900}) {
    const Space space;
    World world(space);
    world.addBoxes(denseCube(n, seedOr(404)));
    dParallelSAPSpaceSetEvents(space, 1);
    const std::size_t pairs = expectedPairs(world.geoms()).size();
    std::pair<dSpaceID, std::size_t> told(space, 0);
    CHECK_THROWS(dSpaceCollide(space, &told, [](void* data, dGeomID, dGeomID) {
      auto& told = *static_cast<std::pair<dSpaceID, std::size_t>*>(data);
      const dParallelSAPPairEvent* begun;
      told.second = dParallelSAPSpaceGetBegunPairs(told.first, &begun);
      throw 1;
    }));
    CHECK(told.second == pairs);
    CHECK(begunOf(space).size() == pairs);
    (void)collide(space);
    CHECK(begunOf(space).empty());
  }
}

TEST_CASE("While memory is given back no event comes twice and nothing is lost", "[events]") {
  for (const int skip : {0, 1}) {
    const std::uint64_t seed = seedOr(409);
    const Space space;
    World world(space);
    world.addBoxes(denseCube(3000, seed));
    // Pairs are verified then, from a list of their own.
    if (skip) world.giveBody(world.geoms()[0]);
    dParallelSAPSpaceSetSkipAsleep(space, skip);
    dParallelSAPSpaceSetEvents(space, 1);
    EventsOracle oracle;
    std::size_t most = 0, least = ~std::size_t{0};
    for (int frame = 0; frame < 150; ++frame) {
      if (frame == 2) world.shrinkTo(300);
      // Others than these keep their pairs.
      const dGeomID mover = world.geoms()[static_cast<std::size_t>(frame)];
      if (frame % 3) dGeomSetPosition(mover, static_cast<dReal>(frame % 7), 2, 2);
      const Pairs pairs = collide(space);
      INFO("skip " << skip << ", frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(oracle.check(space, pairs, EventsOracle::byNumber(world.geoms())) == "");
      most = std::max(most, statsOf(space).memory_bytes);
      least = std::min(least, statsOf(space).memory_bytes);
    }
    CHECK(least < most / 4);
  }
}

TEST_CASE("A touch keeps its number, which no other pair gets meanwhile", "[events]") {
  const Space space;
  dParallelSAPSpaceSetEvents(space, dParallelSAPEventPairs | dParallelSAPEventTouches);
  std::vector<dGeomID> spheres(200);
  for (std::size_t i = 0; i < spheres.size(); ++i) spheres[i] = dCreateSphere(space, 1);
  const auto moveTo = [&](std::size_t i, double x) {
    dGeomSetPosition(spheres[i], static_cast<dReal>(x), 0, 0);
  };
  for (std::size_t i = 2; i < spheres.size(); ++i) moveTo(i, 10.0 * static_cast<double>(i));
  const dParallelSAPContactCallbacks callbacks =
      dParallelSAPContactCallbacksOf([](void*, dGeomID, dGeomID, const dContactGeom*, int) {});
  const auto collideContacts = [&] {
    dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
  };
  const dParallelSAPPairEvent* events;
  collideContacts();
  REQUIRE(dParallelSAPSpaceGetBegunTouches(space, &events) == 1);
  const unsigned number = events[0].number;
  // Collides of other kinds see the pair end and others begin, while the touch lasts.
  moveTo(0, -50);
  (void)collide(space);
  REQUIRE(endedOf(space).size() == 1);
  moveTo(3, 20);
  (void)collide(space);
  (void)collide(space);
  REQUIRE(dParallelSAPSpaceGetBegunPairs(space, &events) == 0);
  unsigned other;
  REQUIRE(dParallelSAPSpaceFindPair(space, spheres[2], spheres[3], &other) == 1);
  CHECK(other != number);
  moveTo(0, 0);
  collideContacts();
  REQUIRE(dParallelSAPSpaceGetBegunTouches(space, &events) == 1);
  CHECK(events[0].number == other);
  moveTo(0, -50);
  collideContacts();
  REQUIRE(dParallelSAPSpaceGetEndedTouches(space, &events) == 1);
  CHECK(events[0].number == number);
  // Then it is free, and the lowest.
  collideContacts();
  moveTo(5, 40);
  collideContacts();
  REQUIRE(dParallelSAPSpaceGetBegunTouches(space, &events) == 1);
  CHECK(events[0].number == number);
}

// More pairs than one chunk. Several threads take the chunks in the test queries.grain.
TEST_CASE("Touches of many pairs are those that callbacks had more or fewer", "[events]") {
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, 3);
  dParallelSAPSpaceSetEvents(space, dParallelSAPEventPairs | dParallelSAPEventTouches);
  World world(space);
  const int side = geomsOf(4900) > 1000 ? 70 : 20;
  // Spheres touch those beside them, but only the boxes of those across.
  for (int i = 0; i < side * side; ++i)
    dGeomSetPosition(world.take(dCreateSphere(space, 1)), dReal(i % side * 1.9),
                     dReal(i / side * 1.9), 0);
  using Touches = std::set<std::pair<dGeomID, dGeomID>>;
  struct Callback {
    static void add(void* touches, dGeomID a, dGeomID b, const dContactGeom*, int) {
      static_cast<Touches*>(touches)->emplace(a, b);
    }
  };
  const dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf(Callback::add);
  const std::uint64_t seed = seedOr(411);
  Random random(seed);
  Touches before;
  std::vector<unsigned> numbers_before;
  for (int frame = 0; frame < 20; ++frame) {
    for (const dGeomID geom : world.geoms()) {
      if (random.chance(frame % 3 == 0 ? 0 : 0.02)) {
        const dReal* const at = dGeomGetPosition(geom);
        dGeomSetPosition(geom, at[0], at[1], at[2] > 0 ? 0 : dReal(random.between(0.3, 3)));
      }
    }
    Touches now, begun, ended;
    dParallelSAPSpaceCollideContacts(space, &now, 1, &callbacks);
    const std::vector<unsigned> numbers = numbersOf(space);
    INFO("frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    REQUIRE((frame > 0 || now.size() > world.geoms().size()));
    std::size_t wrong = 0;
    for (const Event& event : begunTouchesOf(space)) {
      wrong += !begun.emplace(event.o1, event.o2).second || before.count({event.o1, event.o2}) ||
               numbers.at(event.place) != event.number;
    }
    for (const Event& event : endedTouchesOf(space)) {
      wrong += !ended.emplace(event.o1, event.o2).second || now.count({event.o1, event.o2}) ||
               numbers_before.at(event.place) != event.number;
    }
    CHECK(wrong == 0);
    Touches expected = before;
    for (const auto& touch : begun) expected.insert(touch);
    for (const auto& touch : ended) expected.erase(touch);
    CHECK(expected == now);
    before = now;
    numbers_before = numbers;
  }
}

TEST_CASE("Spaces in spaces each see that a geom came at the address of another one", "[events]") {
  const dParallelSAPContactCallbacks callbacks =
      dParallelSAPContactCallbacksOf([](void*, dGeomID, dGeomID, const dContactGeom*, int) {});
  int same_address = 0;
  for (int round = 0; round < 20; ++round) {
    const Space outer;
    const dSpaceID inner = dParallelSAPSpaceCreate(outer), stock = dSimpleSpaceCreate(inner);
    for (const dSpaceID space : {dSpaceID(outer), inner})
      dParallelSAPSpaceSetEvents(space, dParallelSAPEventTouches);
    const auto collideContacts = [&](dSpaceID space) {
      dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
    };
    (void)dCreateSphere(outer, 1);
    dGeomSetPosition(dCreateSphere(inner, 1), 0.5, 0, 0);
    const dGeomID geom = dCreateSphere(stock, 1);
    collideContacts(outer);
    dGeomDestroy(geom);
    same_address += dCreateSphere(stock, 1) == geom;
    collideContacts(inner);
    collideContacts(outer);
    CHECK(begunTouchesOf(outer).size() == 1);
    CHECK(endedTouchesOf(outer).size() == 1);
  }
  if (ADDRESS_SANITIZER)
    WARN("SKIPPED: another geom's address; the sanitizer gives none twice");
  else
    CHECK(same_address > 0);
}

TEST_CASE("What rests stays a pair and a touch until it parts, is disabled or leaves", "[events]") {
  for (const std::size_t others : {0, 300})
    for (const bool asleep : {true, false}) {
      const Space space;
      World world(space);
      for (std::size_t i = 0; i < others; ++i)
        dGeomSetPosition(world.take(dCreateSphere(space, 1)), 0, 0, 10 + 3 * dReal(i));
      std::vector<dGeomID> geoms;
      for (int i = 0; i < 12; ++i) {
        geoms.push_back(world.take(dCreateSphere(space, 1)));
        dGeomSetPosition(geoms.back(), dReal(i / 2 * 10), dReal(i % 2 * 1.5), 0);
        if (asleep) world.giveBody(geoms.back());
      }
      dParallelSAPSpaceSetEvents(space, dParallelSAPEventPairs | dParallelSAPEventTouches);
      struct Frame {
        static void none(void*, dGeomID, dGeomID, const dContactGeom*, int) {}
      };
      const dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf(Frame::none);
      const auto frame = [&] { dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks); };
      frame();
      const Events begun = begunOf(space);
      REQUIRE(begun.size() == 6);
      REQUIRE(begunTouchesOf(space) == begun);
      // All fall asleep, or static pairs are left out.
      if (asleep)
        for (const dGeomID geom : geoms) dBodyDisable(dGeomGetBody(geom));
      (asleep ? dParallelSAPSpaceSetSkipAsleep : dParallelSAPSpaceSetSkipStatic)(space, 1);
      const auto nothing = [&] {
        return begunOf(space).empty() && endedOf(space).empty() && begunTouchesOf(space).empty() &&
               endedTouchesOf(space).empty();
      };
      for (int i = 0; i < 3; ++i) {
        frame();
        INFO(others << " others, asleep " << asleep << ", frame " << i);
        REQUIRE(statsOf(space).pairs == 0);
        REQUIRE(nothing());
      }
      // One moves away, is disabled, gets other bits, leaves; two stay.
      dGeomSetPosition(geoms[1], 0, 5, 0);
      dGeomDisable(geoms[2]);
      dGeomSetCategoryBits(geoms[4], 0);
      dGeomSetCollideBits(geoms[4], 0);
      dSpaceRemove(space, geoms[6]);
      frame();
      Events ended(begun.begin(), begun.begin() + 4);
      ended[3].o1 = nullptr;
      CHECK(endedOf(space) == ended);
      CHECK(endedTouchesOf(space) == ended);
      // The others go on where they are reported again.
      dParallelSAPSpaceSetSkipStatic(space, 0);
      if (asleep)
        for (const dGeomID geom : geoms) dBodyEnable(dGeomGetBody(geom));
      dSpaceAdd(space, geoms[6]);
      frame();
      CHECK(endedOf(space).empty());
      CHECK(begunOf(space) == Events{{geoms[7], geoms[6], 0, begun[0].number}});
      CHECK(begunTouchesOf(space) == begunOf(space));
      unsigned number = 0;
      REQUIRE(dParallelSAPSpaceFindPair(space, geoms[8], geoms[9], &number) == 1);
      CHECK(number == begun[4].number);
    }
}

TEST_CASE("Events that are switched on begin what no other events have followed", "[events]") {
  const Space space;
  for (int i = 0; i < 2; ++i) dCreateSphere(space, 1);
  constexpr int pairs = dParallelSAPEventPairs, touches = dParallelSAPEventTouches;
  const auto begun = [&](int kinds) {
    dParallelSAPSpaceSetEvents(space, kinds);
    const auto ignore = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
    const dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf(ignore);
    dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
    return std::pair(kinds & pairs ? int(begunOf(space).size()) : 0,
                     kinds & touches ? int(begunTouchesOf(space).size()) : 0);
  };
  CHECK(begun(touches) == std::pair(0, 1));
  CHECK(begun(pairs | touches) == std::pair(0, 0));
  CHECK(begun(pairs) == std::pair(0, 0));
  CHECK(begun(pairs | touches) == std::pair(0, 1));
  CHECK(begun(0) == std::pair(0, 0));
  CHECK(begun(pairs | touches) == std::pair(1, 1));
}

TEST_CASE("Who asks for events that are off, or after another call, is told once", "[events]") {
  const Space space;
  dGeomSetPosition(dCreateSphere(space, 1), 1, 0, 0);
  dCreateSphere(space, 1);
  const dParallelSAPPairEvent* events;
  const auto said = [&](int kinds, auto ask) {
    const Space asked;
    dParallelSAPSpaceSetEvents(asked, kinds);
    (void)collide(asked);
    const Messages messages;
    for (int i = 0; i < 2; ++i) ask(asked);
    return messages.all().size() == 1 ? messages.all()[0] : "";
  };
  const auto pairs = [&](dSpaceID asked) { dParallelSAPSpaceGetEndedPairs(asked, &events); };
  const auto begun = [&](dSpaceID asked) { dParallelSAPSpaceGetBegunPairs(asked, &events); };
  const auto find = [&](dSpaceID asked) {
    unsigned number;
    dParallelSAPSpaceFindPair(asked, asGeom(space), asGeom(space), &number);
  };
  const auto touches = [&](dSpaceID asked) { dParallelSAPSpaceGetBegunTouches(asked, &events); };
  const auto names = [](const std::string& text, const char* name) {
    return text.find(name) != std::string::npos;
  };
  CHECK(names(said(0, pairs), "dParallelSAPSpaceGetEndedPairs()"));
  CHECK(names(said(0, begun), "dParallelSAPSpaceGetBegunPairs()"));
  CHECK(names(said(0, find), "dParallelSAPSpaceFindPair()"));
  CHECK(names(said(dParallelSAPEventTouches, pairs), "dParallelSAPEventPairs"));
  CHECK(names(said(dParallelSAPEventPairs, touches), "dParallelSAPEventTouches"));
  CHECK(names(said(dParallelSAPEventTouches, touches), "dParallelSAPSpaceCollideContacts"));
  CHECK(said(dParallelSAPEventPairs, pairs) == "");
}
