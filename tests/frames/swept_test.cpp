// Swept bounds: boxes are the header's, and all that a space finds goes by them. Random calls
// (fuzz) see to sub-spaces, too.
#include "support/events_oracle.h"
#include "support/rules_oracle.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

// Of one of shapes().
dReal smallestSide(dGeomID geom, const Bounds& plain) {
  for (const auto& [kind, side] : {std::pair(dSphereClass, 1.0), std::pair(dBoxClass, 0.6),
                                   std::pair(dCapsuleClass, 0.5), std::pair(dCylinderClass, 0.8)})
    if (dGeomGetClass(geom) == kind) return real(side);
  return std::min({plain[1] - plain[0], plain[3] - plain[2], plain[5] - plain[4]});
}

// The header's formulas, for a geom that lies in the box `plain`.
struct Swept {
  Swept(dGeomID geom, const Bounds& plain, dReal step) : box(plain) {
    const dBodyID body = dGeomGetBody(geom);
    if (!body || !dBodyIsEnabled(body) || step == 0) return;
    const dReal* const centre = dBodyGetPosition(body);
    dVector3 arm, d;
    for (std::size_t i = 0; i < 3; ++i) {
      const dReal below = centre[i] - plain[2 * i], above = plain[2 * i + 1] - centre[i];
      arm[i] = dGeomGetClass(geom) == dSphereClass ? dGeomGetPosition(geom)[i] - centre[i]
                                                   : std::max(std::fabs(below), std::fabs(above));
      d[i] = dBodyGetLinearVel(body)[i] * step;
      if (std::isnan(d[i])) d[i] = 0;
    }
    const dReal angle = dCalcVectorLength3(dBodyGetAngularVel(body)) * step;
    const dReal turned = angle > 0 ? std::min(angle, dReal(2)) * dCalcVectorLength3(arm) : 0;
    for (std::size_t i = 0; i < 3; ++i) {
      box[2 * i] += std::min(d[i], dReal(0)) - turned;
      box[2 * i + 1] += std::max(d[i], dReal(0)) + turned;
    }
    const dReal moved = dCalcVectorLength3(d) + turned, half = smallestSide(geom, plain) / 2;
    fast = moved > half;
    is_at_limit = moved == half || moved == std::nextafter(half, 2 * half);
  }

  Bounds box;
  bool fast = false, is_at_limit = false;
};

// Geoms of all classes in the space under test, and others like them in one whose boxes are plain.
class Twins {
  const Space plain_space_;

 public:
  World swept, plain{plain_space_};

  Twins(dSpaceID space, std::size_t size, std::uint64_t seed)
      : swept(space), random_(seed), side_(2.2 * std::cbrt(double(size))), next_(size) {
    for (World* const world : {&swept, &plain})
      for (std::size_t i = 0; world->geoms().size() < size; ++i) {
        const Shape& shape = shapes()[i % shapes().size()];
        if (!shape.placeable) continue;
        const dGeomID geom = world->take(shape.create(world->space()));
        if (i % 7 != 3) world->giveBody(geom);
        if (i % 7 == 5) dGeomSetOffsetPosition(geom, real(0.5), real(-0.25), 1);
      }
  }

  // All geoms move or some do; some get another speed, sleep, wake, lose their body or leave.
  void change(int frame) {
    for (std::size_t i = 0; i < swept.geoms().size(); ++i) {
      if (frame % 4 == 0 || random_.chance(0.05)) move(i);
      if (random_.chance(frame ? 0.1 : 1)) push(i);
      const auto change = random_.chance(0.5) ? dBodyEnable : dBodyDisable;
      if (random_.chance(0.05)) both(i, [change](dGeomID geom) { change(dGeomGetBody(geom)); });
    }
    if (frame % 3 != 2) return;
    both(random_.below(swept.geoms().size()), [](dGeomID geom) {
      dGeomClearOffset(geom);
      dGeomSetBody(geom, nullptr);
    });
    leave(frame % 8 == 5 ? swept.geoms().size() * 4 / 5 : 1);
  }

 private:
  dReal number(double low, double high) { return real(random_.between(low, high)); }

  template <class Change>
  void both(std::size_t i, Change change) {
    if (!dGeomGetBody(swept.geoms()[i])) return;
    for (const World* const world : {&swept, &plain}) change(world->geoms()[i]);
  }
  void move(std::size_t i) {
    const dReal x = number(0, side_), y = number(0, side_), z = number(0, side_);
    dMatrix3 rotation;
    dRFromEulerAngles(rotation, x, y, z);
    for (const World* const world : {&swept, &plain}) {
      dGeomSetPosition(world->geoms()[i], x, y, z);
      dGeomSetRotation(world->geoms()[i], rotation);
    }
  }
  // Speeds that are zero, usual, infinite, no number, and at the limit of the fast.
  void push(std::size_t i) {
    const double v = random_.chance(0.3) ? 0 : 20, w = random_.chance(0.5) ? 0 : 20;
    dReal speeds[6] = {number(-v, v), number(-v, v), number(-v, v),
                       number(-w, w), number(-w, w), number(-w, w)};
    for (int ill = random_.chance(0.03) ? 2 : 0; ill > 0; --ill)
      speeds[random_.below(6)] = random_.chance(0.5) ? -kInfinity : kNaN;
    // Just half of its smallest side in a step of 1/64, or a little more.
    if (random_.chance(0.3)) {
      const dReal half = 32 * smallestSide(plain.geoms()[i], boundsOf(plain.geoms()[i]));
      std::fill(std::begin(speeds), std::end(speeds), dReal(0));
      speeds[random_.below(3)] = random_.chance(0.5) ? -half : std::nextafter(half, kInfinity);
    }
    both(i, [&](dGeomID geom) {
      dBodySetLinearVel(dGeomGetBody(geom), speeds[0], speeds[1], speeds[2]);
      dBodySetAngularVel(dGeomGetBody(geom), speeds[3], speeds[4], speeds[5]);
    });
  }
  // So many geoms leave, which have their own boxes then, and come back by other numbers.
  void leave(std::size_t count) {
    std::vector<std::pair<dGeomID, dGeomID>> gone;
    for (; count > 0; --count) {
      const std::size_t i = random_.below(swept.geoms().size());
      gone.emplace_back(swept.geoms()[i], plain.geoms()[i]);
      swept.remove(gone.back().first);
      plain.remove(gone.back().second);
      CHECK(boundsOf(gone.back().first) == boundsOf(gone.back().second));
    }
    for (const auto& [one, other] : gone) {
      setNumber(one, next_++);
      swept.addAgain(one);
      plain.addAgain(other);
    }
  }

  Random random_;
  const double side_;
  std::size_t next_;
};

std::vector<dContactGeom> sweptContacts(dGeomID a, dGeomID b, dReal step) {
  std::vector<dContactGeom> contacts(4);
  contacts.resize(static_cast<std::size_t>(
      dParallelSAPCollideSwept(a, b, step, 4, contacts.data(), sizeof(dContactGeom))));
  return contacts;
}

// The bits of what might be disturbed; some are no numbers.
std::string stateOf(dGeomID geom) {
  const Bounds box = boundsOf(geom);
  const auto bits = [](const dReal* numbers, std::size_t count) {
    return std::string(reinterpret_cast<const char*>(numbers), count * sizeof(dReal));
  };
  return bits(box.data(), 6) + bits(dGeomGetPosition(geom), 3) + bits(dGeomGetRotation(geom), 12);
}

Pairs pairsWith(const std::vector<dGeomID>& geoms, dGeomID probe) {
  Pairs pairs;
  for (const dGeomID geom : geoms)
    if (takesPart(geom) && mayTouch(geom, probe)) pairs.emplace_back(number(geom), number(probe));
  return pairs;
}

}  // namespace

TEST_CASE("Boxes are the header's, bit for bit; pairs, events, queries and contacts go by them",
          "[swept]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t size : {std::size_t{40}, std::size_t{180}, geomsOf(900)})
      for (const int threads : {0, 3}) {
        const Space space(configuration), others(configuration);
        dParallelSAPSpaceSetNumThreads(space, threads);
        dParallelSAPSpaceSetEvents(space, 1);
        EventsOracle events;
        Twins twins(space, size, seedOr(size));
        const std::vector<dGeomID>& geoms = twins.swept.geoms();
        World probes(others);
        const dGeomID probe = probes.take(dCreateSphere(others, 1));
        setNumber(probe, 1000000);
        dBodySetPosition(probes.giveBody(probe), 2, 2, 2);
        std::size_t contacts = 0, fast[2] = {0, 0}, at_limit[2] = {0, 0};
        for (int frame = 0; frame < 24; ++frame) {
          // On, off, another one.
          const dReal step = frame % 8 == 6 ? 0 : real(frame % 8 == 7 ? 0.05 : 1.0 / 64);
          INFO(configuration.name << ", " << size << " geoms, " << threads << " threads, frame "
                                  << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seedOr(size));
          twins.change(frame);
          dBodySetLinearVel(dGeomGetBody(probe), real(10 * frame), 0, real(-5 * frame));
          for (const dSpaceID id : {dSpaceID(space), dSpaceID(others)})
            dParallelSAPSpaceSetSweptBounds(id, step);
          dParallelSAPSpaceSetTolerance(space, real(frame / 8 == 1 ? 0.3 : 0));
          if (frame % 3 == 1) {
            const Pairs hits = collide2(space, probe);
            REQUIRE(boundsOf(probe) == Swept(probe, {1, 3, 1, 3, 1, 3}, step).box);
            REQUIRE(difference(hits, pairsWith(geoms, probe)) == "");
          }
          Pairs pairs;
          collide(space, [&](dGeomID a, dGeomID b) {
            record(&pairs, a, b);
            // Swept contacts while the space is locked.
            const auto oneIs = [&](int of) {
              return dGeomGetClass(a) == of || dGeomGetClass(b) == of;
            };
            const bool may_assert = oneIs(dConvexClass) && oneIs(dTriMeshClass);
            if (step == 0 || size >= 900 || may_assert) return;
            const std::string before = stateOf(a) + stateOf(b);
            contacts += sweptContacts(a, b, step).size();
            REQUIRE((stateOf(a) + stateOf(b) == before));
          });
          for (std::size_t i = 0; i < size; ++i) {
            const Swept expected(geoms[i], boundsOf(twins.plain.geoms()[i]), step);
            REQUIRE(boundsOf(geoms[i]) == expected.box);
            REQUIRE((dParallelSAPSpaceIsFast(space, geoms[i]) != 0) == expected.fast);
            ++fast[expected.fast];
            at_limit[expected.fast] += expected.is_at_limit;
          }
          REQUIRE(wrongByRules(Rules::of(space), geoms, pairs) == "");
          REQUIRE(events.check(space, pairs, EventsOracle::byNumber(geoms)) == "");
        }
        CHECK(std::min(fast[0], fast[1]) > size);
        CHECK((contacts > 0) == (size < 900));
        CHECK(std::min(at_limit[0], at_limit[1]) > 5);
      }
}

TEST_CASE("Spaces around a swept one have its box, however it came and was asked before",
          "[swept]") {
  enum { nothing, query_of_ball, query_of_space, own_frame, kWays };
  constexpr dReal step = 0.5;
  for (const int depth : {1, 2, 3})
    for (const bool comes : {false, true})
      for (int way = 0; way < kWays; ++way) {
        CAPTURE(depth, comes, way);
        const Space outermost, other;
        World world(outermost);
        std::vector<dSpaceID> around = {outermost};
        for (int i = 1; i < depth; ++i) around.push_back(dParallelSAPSpaceCreate(around.back()));
        around.push_back(dParallelSAPSpaceCreate(comes ? nullptr : around.back()));
        const dSpaceID swept = around.back();
        dParallelSAPSpaceSetSweptBounds(swept, step);
        if (comes) dSpaceAdd(around.end()[-2], asGeom(swept));
        const dGeomID ball = dCreateSphere(swept, 1);
        const dBodyID body = world.giveBody(ball);
        dGeomSetPosition(dCreateSphere(swept, 1), 9, 0, 0);
        dGeomSetPosition(dCreateBox(other, 1, 1, 1), 11, 0, 0);
        dSpaceSetSublevel(other, 1);  // the swept space meets it as one geom
        for (const int speed : {0, 20, 10, 20}) {
          dBodySetLinearVel(body, static_cast<dReal>(speed), 0, 0);
          const std::size_t hits = speed == 20;
          if (way == query_of_ball) CHECK(collide2(other, ball).size() == hits);
          if (way == query_of_space) CHECK(collide2(other, asGeom(swept)).size() == hits);
          if (way == own_frame) (void)collide(swept);
          (void)collide(outermost);
          for (std::size_t i = 1; i < around.size(); ++i)
            CHECK(boundsOf(asGeom(around[i])) == Bounds{-1, dReal(hits ? 11 : 10), -1, 1, -1, 1});
          CHECK(collide(swept).size() == hits);
        }
      }
}

TEST_CASE("Who comes in the place of a fast geom is none", "[swept]") {
  const Space space;
  World world(space);
  dParallelSAPSpaceSetSweptBounds(space, 1);
  dBodySetLinearVel(world.giveBody(world.take(dCreateSphere(space, 1))), 9, 0, 0);
  (void)collide(space);
  CHECK(dParallelSAPSpaceIsFast(space, world.geoms()[0]));
  world.shrinkTo(0);
  CHECK(!dParallelSAPSpaceIsFast(space, world.take(dCreateSphere(space, 1))));
}

TEST_CASE("A geom that has moved is where it is after a swept contact, too", "[swept]") {
  const Space space;
  World world(space);
  const dGeomID ball = world.take(dCreateSphere(space, 1)),
                other = world.addBox({{8, -1, -1}, {9, 1, 1}});
  const dBodyID body = world.giveBody(ball);
  dBodySetLinearVel(body, 9, 0, 0);
  CHECK(collide(space).empty());
  dBodySetPosition(body, 7.5, 0, 0);
  (void)sweptContacts(ball, other, 1);
  CHECK(collide(space).size() == 1);
}

TEST_CASE("A stock space has the box of a swept one in it after the swept one's frame", "[swept]") {
  const dSpaceID stock = dSimpleSpaceCreate(nullptr), swept = dParallelSAPSpaceCreate(stock);
  {
    World world(swept);
    dParallelSAPSpaceSetSweptBounds(swept, 1);
    const dBodyID body = world.giveBody(world.take(dCreateSphere(nullptr, 1)));
    dGeomSetPosition(dCreateBox(stock, 1, 1, 1), 9, 0, 0);
    for (const int speed : {0, 10, 0, 10}) {
      dBodySetLinearVel(body, static_cast<dReal>(speed), 0, 0);
      (void)collide(swept);
      CHECK(collide(stock).size() == (speed > 0 ? 1 : 0));
    }
  }
  dSpaceDestroy(stock);
}

TEST_CASE("A swept contact says how far geoms come until they touch, and leaves them as they are",
          "[swept]") {
  const dReal step = real(0.01);
  for (const bool offset : {false, true})
    for (const bool swept : {false, true}) {
      const Space space;
      World world(space);
      const dGeomID ball = world.take(dCreateSphere(space, 1)),
                    floor = dCreateBox(space, 90, 90, 2);
      const dBodyID body = world.giveBody(ball);
      dBodySetPosition(body, 3, 0, 11);
      if (offset) dGeomSetOffsetPosition(ball, 0, 1, 0);
      if (swept) dParallelSAPSpaceSetSweptBounds(space, step);
      INFO("offset " << offset << ", swept " << swept);
      const auto check = [&](dReal down, dReal aside, std::size_t count, double depth) {
        dBodySetLinearVel(body, aside / step, 0, -down / step);
        (void)collide(space);
        const std::string before = stateOf(ball);
        for (const bool first : {false, true}) {
          const auto found =
              first ? sweptContacts(floor, ball, step) : sweptContacts(ball, floor, step);
          REQUIRE(found.size() == count);
          if (count == 0) continue;
          CHECK(double(found[0].depth) == Approx(depth).margin(1e-4));
          CHECK(double(found[0].normal[2]) == Approx(first ? -1 : 1));
          // It stops a body that falls, and turns none.
          if (down > 1) CHECK(std::hypot(found[0].pos[0] - 3, found[0].pos[1]) < dReal(1e-4));
        }
        CHECK((stateOf(ball) == before));
      };
      check(8, 0, 0, 0);  // down to 1 m above the floor
      check(10, 0, 1, -9);
      check(500, 77, 1, -9);
      check(kInfinity, 0, 0, 0);
      dBodySetPosition(body, 3, 0, real(1.9));
      check(1, 0, 1, 0.1);  // no more than half of its size
      check(9, 0, 1, 0.1);
      check(0, 9, 1, 0.1);
      dBodyDisable(body);
      dBodySetPosition(body, 3, 0, 11);
      check(10, 0, 0, 0);
      // A lift comes to a ball that rests, once in either order.
      dBodyEnable(body);
      dBodySetLinearVel(body, 0, 0, 0);
      const dBodyID lift = world.giveBody(floor);
      dBodySetKinematic(lift);
      dBodySetLinearVel(lift, 0, 0, 20 / step);
      for (const auto& found :
           {sweptContacts(floor, ball, step), sweptContacts(ball, floor, step)}) {
        REQUIRE(found.size() == 1);
        CHECK(double(found[0].depth) == Approx(-9).margin(1e-4));
      }
    }
}
