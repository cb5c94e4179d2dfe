// Which pairs and touches began and ended: what random edits (fuzz) do not reach.
#include "support/contact_scene.h"
#include "support/events_oracle.h"
#include "support/tests.h"

using namespace sap_test;

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

TEST_CASE("While memory is given back no event comes twice and nothing is lost", "[events]") {
  for (const int skip : {0, 1}) {
    const std::uint64_t seed = seedOr(409);
    const Space space;
    World world(space, denseCube(3000, seed));
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
      if (frame % 3) dGeomSetPosition(mover, real(frame % 7), 2, 2);
      const Pairs pairs = collide(space);
      INFO("skip " << skip << ", frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(oracle.check(space, pairs, EventsOracle::byNumber(world.geoms())) == "");
      most = std::max(most, statsOf(space).memory_bytes);
      least = std::min(least, statsOf(space).memory_bytes);
    }
    CHECK(least < most / 4);
  }
}

TEST_CASE("Touches that a callback switches on begin in the next collide", "[events]") {
  const Space space;
  dCreateSphere(dSimpleSpaceCreate(space), 1);
  dCreateSphere(space, 1);
  dParallelSAPSpaceSetEvents(space, dParallelSAPEventPairs);
  dParallelSAPContactCallbacks callbacks =
      dParallelSAPContactCallbacksOf([](void*, dGeomID, dGeomID, const dContactGeom*, int) {});
  callbacks.spaces = [](void* data, dGeomID o1, dGeomID o2, void* pairs) {
    dParallelSAPSpaceSetEvents(static_cast<dSpaceID>(data),
                               dParallelSAPEventPairs | dParallelSAPEventTouches);
    dSpaceCollide2(o1, o2, pairs, dParallelSAPAddPair);
  };
  const Messages messages;
  for (const std::size_t begun : {0, 1}) {
    dParallelSAPSpaceCollideContacts(space, dSpaceID(space), 1, &callbacks);
    CHECK(begunTouchesOf(space).size() == begun);
  }
  CHECK(messages.all().empty());
}

TEST_CASE("A touch that has outlived its pair lasts while that rests, and when it wakes",
          "[events]") {
  const Space space;
  World world(space);
  world.take(dCreateSphere(space, 1));
  const dBodyID body = world.giveBody(world.take(dCreateSphere(space, 1)));
  dParallelSAPSpaceSetSkipAsleep(space, 1);
  dParallelSAPSpaceSetEvents(space, dParallelSAPEventTouches);
  const dParallelSAPContactCallbacks callbacks =
      dParallelSAPContactCallbacksOf([](void*, dGeomID, dGeomID, const dContactGeom*, int) {});
  const auto changes = [&] {
    dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
    return begunTouchesOf(space).size() + endedTouchesOf(space).size();
  };
  CHECK(changes() == 1);
  dBodySetPosition(body, 9, 0, 0);
  CHECK(collide(space).empty());
  dBodySetPosition(body, 1, 0, 0);
  dBodyDisable(body);
  CHECK(changes() == 0);
  dBodyEnable(body);
  CHECK(changes() == 0);
}

TEST_CASE("Who asks for events that are off, or after another call, is told once", "[events]") {
  const auto said = [](int kinds, const char* word, auto ask) {
    const Space asked, other;
    for (const dSpaceID space : {dSpaceID(asked), dSpaceID(asked), dSpaceID(other)})
      (void)dCreateSphere(space, 1);
    const dGeomID stranger = dCreateSphere(other, 1);  // at the place of one that is in a pair
    dParallelSAPSpaceSetEvents(asked, kinds);
    (void)collide(asked);
    const Messages messages;
    for (int i = 0; i < 2; ++i) CHECK(ask(asked, stranger) == 0);
    INFO(word);
    REQUIRE(messages.all().size() == (*word ? 1 : 0));
    if (*word) CHECK(messages.all()[0].find(word) != std::string::npos);
  };
  const auto askedBy = [](auto get) {
    return [get](dSpaceID space, dGeomID) {
      const dParallelSAPPairEvent* events;
      return get(space, &events);
    };
  };
  const auto ended = askedBy(dParallelSAPSpaceGetEndedPairs),
             touches = askedBy(dParallelSAPSpaceGetBegunTouches);
  const auto find = [](dSpaceID space, dGeomID geom) {
    unsigned number = 77;
    const dGeomID own = dSpaceGetGeom(space, 0);
    const int found = dParallelSAPSpaceFindPair(space, geom, own, &number) +
                      dParallelSAPSpaceFindPair(space, own, geom, &number);
    return found + (number != 77);
  };
  said(0, "dParallelSAPSpaceGetEndedPairs()", ended);
  said(0, "dParallelSAPSpaceGetBegunPairs()", askedBy(dParallelSAPSpaceGetBegunPairs));
  said(0, "dParallelSAPSpaceFindPair()", find);
  said(dParallelSAPEventTouches, "dParallelSAPEventPairs", ended);
  said(dParallelSAPEventPairs, "dParallelSAPEventTouches", touches);
  said(dParallelSAPEventTouches, "dParallelSAPSpaceCollideContacts", touches);
  said(dParallelSAPEventPairs, "", ended);
  said(dParallelSAPEventPairs, "", find);
}
