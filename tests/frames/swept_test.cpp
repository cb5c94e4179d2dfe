// Swept bounds: boxes are the header's, and all that a space finds goes by them. Boxes of
// sub-spaces follow in spaces of ours, and stock spaces around them are left as they are.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/events_oracle.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/rules_oracle.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

dReal lengthOf(const dReal* v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// Of one of shapes().
dReal smallestSide(dGeomID geom, const Bounds& plain) {
  switch (dGeomGetClass(geom)) {
    case dSphereClass:
      return 1;
    case dBoxClass:
      return real(0.6);
    case dCapsuleClass:
      return real(0.5);
    case dCylinderClass:
      return 2 * real(0.4);
    default:
      return std::min({plain[1] - plain[0], plain[3] - plain[2], plain[5] - plain[4]});
  }
}

// The header's formulas, for a geom that lies in the box `plain`.
struct Swept {
  Swept(dGeomID geom, const Bounds& plain, dReal step) : box(plain) {
    const dBodyID body = dGeomGetBody(geom);
    if (!body || !dBodyIsEnabled(body) || step == 0) return;
    const dReal* const centre = dBodyGetPosition(body);
    dReal arm[3], d[3];
    for (std::size_t i = 0; i < 3; ++i) {
      const dReal below = centre[i] - plain[2 * i], above = plain[2 * i + 1] - centre[i];
      arm[i] = dGeomGetClass(geom) == dSphereClass ? dGeomGetPosition(geom)[i] - centre[i]
                                                   : std::max(std::fabs(below), std::fabs(above));
      d[i] = dBodyGetLinearVel(body)[i] * step;
      if (std::isnan(d[i])) d[i] = 0;
    }
    const dReal angle = lengthOf(dBodyGetAngularVel(body)) * step;
    const dReal turned = angle > 0 ? std::min(angle, dReal(2)) * lengthOf(arm) : 0;
    for (std::size_t i = 0; i < 3; ++i) {
      box[2 * i] += std::min(d[i], dReal(0)) - turned;
      box[2 * i + 1] += std::max(d[i], dReal(0)) + turned;
    }
    const dReal moved = lengthOf(d) + turned, half = smallestSide(geom, plain) / 2;
    fast = moved > half;
    is_at_limit = moved == half || moved == std::nextafter(half, 2 * half);
  }

  Bounds box;
  bool fast = false, is_at_limit = false;
};

// Geoms of all classes in the space under test, and others like them in one whose boxes are plain.
class Twins {
 public:
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
      if (random_.chance(0.05))
        both(
            i, random_.chance(0.5) ? [](dGeomID geom) { dBodyEnable(dGeomGetBody(geom)); }
                                   : [](dGeomID geom) { dBodyDisable(dGeomGetBody(geom)); });
    }
    if (frame % 3 != 2) return;
    both(random_.below(swept.geoms().size()), [](dGeomID geom) {
      dGeomClearOffset(geom);
      dGeomSetBody(geom, nullptr);
    });
    leave(frame % 8 == 5 ? swept.geoms().size() * 4 / 5 : 1);
  }
  Swept expected(std::size_t i, dReal step) const {
    return {swept.geoms()[i], boundsOf(plain.geoms()[i]), step};
  }

  World swept;

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
    using Limits = std::numeric_limits<dReal>;
    const double v = random_.chance(0.3) ? 0 : 20, w = random_.chance(0.5) ? 0 : 20;
    dReal speeds[6] = {number(-v, v), number(-v, v), number(-v, v),
                       number(-w, w), number(-w, w), number(-w, w)};
    for (int ill = random_.chance(0.03) ? 2 : 0; ill > 0; --ill)
      speeds[random_.below(6)] = random_.chance(0.5) ? -Limits::infinity() : Limits::quiet_NaN();
    if (random_.chance(
            0.1)) {  // just half of its smallest side in a step of 1/64, or a little more
      const dReal half = 32 * smallestSide(plain.geoms()[i], boundsOf(plain.geoms()[i]));
      std::fill(std::begin(speeds), std::end(speeds), dReal(0));
      speeds[random_.below(3)] = random_.chance(0.5) ? -half : std::nextafter(half, Limits::max());
    }
    both(i, [&](dGeomID geom) {
      dBodySetLinearVel(dGeomGetBody(geom), speeds[0], speeds[1], speeds[2]);
      dBodySetAngularVel(dGeomGetBody(geom), speeds[3], speeds[4], speeds[5]);
    });
  }
  // So many geoms leave, which have their own boxes then, and come back by other numbers.
  void leave(std::size_t count) {
    std::vector<dGeomID> gone[2];
    for (; count > 0; --count) {
      const std::size_t i = random_.below(swept.geoms().size());
      for (World* const world : {&swept, &plain}) {
        gone[world == &plain].push_back(world->geoms()[i]);
        world->remove(world->geoms()[i]);
      }
      CHECK(boundsOf(gone[0].back()) == boundsOf(gone[1].back()));
    }
    for (std::size_t i = 0; i < gone[0].size(); ++i) {
      setNumber(gone[0][i], next_++);
      swept.addAgain(gone[0][i]);
      plain.addAgain(gone[1][i]);
    }
  }

  const Space plain_space_;
  World plain{plain_space_};
  Random random_;
  const double side_;
  std::size_t next_;
};

// For near callbacks and in blocks, in turn.
Pairs collideInTurn(dSpaceID space, int frame) {
  if (frame % 2 == 0) return collide(space);
  Pairs pairs;
  dParallelSAPSpaceCollidePairs(
      space, &pairs, 0,
      [](void* data, const dParallelSAPPair* some, std::size_t count, std::size_t) {
        for (std::size_t i = 0; i < count; ++i) record(data, some[i].o1, some[i].o2);
      });
  return pairs;
}

Pairs pairsWith(const std::vector<dGeomID>& geoms, dGeomID probe) {
  Pairs pairs;
  for (const dGeomID geom : geoms)
    if (takesPart(geom) && mayTouch(geom, probe)) pairs.emplace_back(number(geom), number(probe));
  return pairs;
}

}  // namespace

TEST_CASE("Boxes are the header's, bit for bit, and pairs, events and queries go by them",
          "[swept]") {
  constexpr std::size_t kProbeNumber = 1000000;
  for (const Configuration& configuration : configurations())
    for (const std::size_t size : {std::size_t{40}, std::size_t{180}, geomsOf(900)})
      for (const int threads : {0, 3}) {
        const std::uint64_t seed = seedOr(size);
        const Space space(configuration), others(configuration);
        dParallelSAPSpaceSetNumThreads(space, threads);
        dParallelSAPSpaceSetEvents(space, 1);
        EventsOracle events;
        Twins twins(space, size, seed);
        const std::vector<dGeomID>& geoms = twins.swept.geoms();
        World probes(others);
        const dGeomID probe = probes.take(dCreateSphere(others, 1));
        setNumber(probe, kProbeNumber);
        dBodySetPosition(probes.giveBody(probe), 2, 2, 2);
        std::size_t fast = 0, slow = 0, at_limit[2] = {0, 0};
        for (int frame = 0; frame < 24; ++frame) {
          // On, off, another one.
          const dReal step = frame % 8 == 6 ? 0 : real(frame % 8 == 7 ? 0.05 : 1.0 / 64);
          INFO(configuration.name << ", " << size << " geoms, " << threads << " threads, frame "
                                  << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
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
          const Pairs pairs = collideInTurn(space, frame);
          for (std::size_t i = 0; i < size; ++i) {
            const Swept expected = twins.expected(i, step);
            REQUIRE(boundsOf(geoms[i]) == expected.box);
            REQUIRE((dParallelSAPSpaceIsFast(space, geoms[i]) != 0) == expected.fast);
            ++(expected.fast ? fast : slow);
            at_limit[expected.fast] += expected.is_at_limit;
          }
          REQUIRE(wrongByRules(Rules::of(space), geoms, pairs) == "");
          REQUIRE(events.check(space, pairs, EventsOracle::byNumber(geoms)) == "");
        }
        CHECK(fast > size);
        CHECK(slow > size);
        CHECK(std::min(at_limit[0], at_limit[1]) > 5);
      }
}

namespace {

// A sphere with a body that does not turn.
struct Ball {
  Ball(dSpaceID space, dWorldID world, std::size_t number)
      : body(dBodyCreate(world)), geom(dCreateSphere(space, real(0.5))) {
    dGeomSetBody(geom, body);
    setNumber(geom, number);
  }
  void move(Random& random, double side) const {
    dBodySetPosition(body, real(random.between(0, side)), real(random.between(0, side)), 0);
  }
  void push(Random& random) const {
    dBodySetLinearVel(body, real(random.between(-9, 9)), real(random.between(-9, 9)), 0);
  }
  Bounds swept(dReal step) const {
    const dReal* const at = dBodyGetPosition(body);
    Bounds plain;
    for (std::size_t i = 0; i < 6; ++i) plain[i] = at[i / 2] + real(i % 2 ? 0.5 : -0.5);
    return Swept(geom, plain, step).box;
  }

  dBodyID body;
  dGeomID geom;
};

std::vector<dGeomID> makeWalls(dSpaceID space, std::size_t count, double side, Random& random) {
  std::vector<dGeomID> walls;
  for (std::size_t i = 0; i < count; ++i) {
    walls.push_back(dCreateBox(space, 1, 1, 1));
    dGeomSetPosition(walls[i], real(random.between(0, side)), real(random.between(0, side)), 0);
    setNumber(walls[i], 1000 + i);
  }
  return walls;
}

// The spaces around a swept one.
struct Around {
  const char* name;
  std::vector<dSpaceID (*)(dSpaceID parent)> create;
};
const std::vector<Around> kOurs = {
    {"none", {}},
    {"ours", {dParallelSAPSpaceCreate}},
    {"ours in ours", {dParallelSAPSpaceCreate, dParallelSAPSpaceCreate}}};
const std::vector<Around> kStock = {
    {"simple", {dSimpleSpaceCreate}},
    {"simple in hash", {dHashSpaceCreate, dSimpleSpaceCreate}},
    {"simple in ours", {dParallelSAPSpaceCreate, dSimpleSpaceCreate}},
    {"ours in simple", {dSimpleSpaceCreate, dParallelSAPSpaceCreate}}};

// Swept spaces with two balls each, and what is around them within `parent`.
struct Nest {
  Nest(dSpaceID parent, const Around& around, dWorldID world, std::size_t number) {
    for (const auto create : around.create) add(create(parent), parent);
    swept = dParallelSAPSpaceCreate(nullptr);
    dParallelSAPSpaceSetSweptBounds(swept, kStep);
    dSpaceAdd(parent, asGeom(swept));  // it comes with what it has
    if (!outermost) outermost = asGeom(swept);
    setNumber(outermost, number);
    for (std::size_t i = 0; i < 2; ++i) balls.emplace_back(swept, world, 10 * number + i);
  }
  void add(dSpaceID space, dSpaceID& parent) {
    if (!outermost) outermost = asGeom(space);
    parent = space;
  }
  Bounds box() const {
    Bounds box = balls[0].swept(kStep);
    const Bounds other = balls[1].swept(kStep);
    for (std::size_t i = 0; i < 6; ++i)
      box[i] = i % 2 ? std::max(box[i], other[i]) : std::min(box[i], other[i]);
    return box;
  }

  static constexpr dReal kStep = 0.5;
  dGeomID outermost = nullptr;
  dSpaceID swept;
  std::vector<Ball> balls;
};

std::vector<Nest> makeNests(std::size_t count, dSpaceID parent, const Around& around,
                            dWorldID world, double side, Random& random) {
  std::vector<Nest> nests;
  for (std::size_t i = 0; i < count; ++i) {
    nests.emplace_back(parent, around, world, i);
    for (const Ball& ball : nests[i].balls) ball.move(random, side);
  }
  return nests;
}

// What a program may do with a nest before what is around it is collided.
void disturb(const Nest& nest, dSpaceID other, double side, Random& random) {
  const Ball& ball = nest.balls[random.below(2)];
  if (random.chance(0.15)) ball.move(random, side);
  if (random.chance(0.3)) ball.push(random);
  if (random.chance(0.1)) random.chance(0.7) ? dBodyEnable(ball.body) : dBodyDisable(ball.body);
  const std::function<void()> ways[] = {
      [&] { boundsOf(asGeom(nest.swept)); },
      [&] { boundsOf(nest.outermost); },
      [&] { boundsOf(ball.geom); },
      [&] { collide2(nest.outermost, asGeom(other)); },
      [&] { collide2(other, ball.geom); },
      [&] { collide2(other, asGeom(nest.swept)); },
      [&] { collide(nest.swept); },
      [&] { dSpaceClean(nest.swept); },
      [&] { dSpaceClean(reinterpret_cast<dSpaceID>(nest.outermost)); }};
  if (random.chance(0.5)) ways[random.below(std::size(ways))]();
}

// Takes pairs with spaces apart, and collides these spaces, too.
void takeApart(void* data, dGeomID a, dGeomID b) {
  if (!dGeomIsSpace(a) && !dGeomIsSpace(b)) return record(data, a, b);
  dSpaceCollide2(a, b, data, takeApart);
  for (const dGeomID geom : {a, b})
    if (dGeomIsSpace(geom)) dSpaceCollide(reinterpret_cast<dSpaceID>(geom), data, takeApart);
}

}  // namespace

TEST_CASE("Boxes of sub-spaces follow their swept geoms, whatever was asked before", "[swept]") {
  const double side = 30;
  for (const Configuration& configuration : configurations())
    for (const Around& around : kOurs) {
      const std::uint64_t seed = seedOr(3);
      Random random(seed);
      const dWorldID world = dWorldCreate();
      const Space outer(configuration), other(configuration);
      const std::vector<Nest> nests = makeNests(5, outer, around, world, side, random);
      const dGeomID probe = makeWalls(other, 7, side, random)[0];
      std::vector<dGeomID> geoms;
      for (const Nest& nest : nests) geoms.push_back(nest.outermost);
      for (const dGeomID wall : makeWalls(outer, 12, side, random)) geoms.push_back(wall);
      for (int frame = 0; frame < 60; ++frame) {
        INFO(configuration.name << ", " << around.name << ", frame " << frame
                                << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        for (const Nest& nest : nests)
          for (int i = 0; i < 2; ++i) disturb(nest, other, side, random);
        const bool query = frame % 4 == 3;
        const Pairs pairs = query ? collide2(outer, probe) : collide(outer);
        for (const Nest& nest : nests) REQUIRE(boundsOf(nest.outermost) == nest.box());
        REQUIRE(difference(pairs, query ? pairsWith(geoms, probe) : expectedPairs(geoms)) == "");
      }
      dWorldDestroy(world);
    }
}

TEST_CASE("A stock space around swept ones misses no pair of geoms as they lie", "[swept]") {
  const double side = 12;
  std::vector<Around> all = kOurs;
  all.insert(all.end(), kStock.begin(), kStock.end());
  for (const Around& around : all)
    for (const auto create : {dSimpleSpaceCreate, dHashSpaceCreate}) {
      Random random(seedOr(11));
      const dWorldID world = dWorldCreate();
      const Space other(configurations()[0]);
      const std::vector<dGeomID> walls = makeWalls(other, 20, side, random);
      const dSpaceID stock = create(nullptr);
      const std::vector<Nest> nests = makeNests(4, stock, around, world, side, random);
      std::vector<Ball> balls, loose;
      for (std::size_t i = 0; i < 4; ++i) loose.emplace_back(stock, world, 100 + i);
      for (const Nest& nest : nests)
        balls.insert(balls.end(), nest.balls.begin(), nest.balls.end());
      balls.insert(balls.end(), loose.begin(), loose.end());
      std::size_t found = 0;
      for (int frame = 0; frame < 60; ++frame) {
        // Of speeds no space is told.
        for (const Ball& ball : balls) {
          if (frame % 4 == 0 || (frame > 20 && random.chance(0.2))) ball.move(random, side);
          if (random.chance(0.5)) ball.push(random);
        }
        INFO(around.name << ", frame " << frame);
        Pairs pairs, expected;
        if (&around < &all[kOurs.size()]) {
          for (const dGeomID wall : walls) {
            for (const Nest& nest : nests)
              if (overlap(nest.box(), boundsOf(wall)))
                expected.emplace_back(number(nest.outermost), number(wall));
            for (const Ball& ball : loose)
              if (overlap(ball.swept(0), boundsOf(wall)))
                expected.emplace_back(number(ball.geom), number(wall));
          }
          REQUIRE(difference(asSet(collide2(stock, other.geom())), asSet(expected)) == "");
        }
        dSpaceCollide(stock, &pairs, takeApart);
        pairs = asSet(pairs);
        for (const Ball& a : balls)
          for (const Ball& b : balls) {
            const Pair pair(number(a.geom), number(b.geom));
            // Pairs within a nest come up where the nest itself is in one.
            const bool nested = pair.first < 100 && pair.first / 10 == pair.second / 10;
            if (nested || pair.first >= pair.second || !overlap(a.swept(0), b.swept(0))) continue;
            REQUIRE(std::binary_search(pairs.begin(), pairs.end(), pair));
            ++found;
          }
      }
      CHECK(found > 20);
      dSpaceDestroy(stock);
      dWorldDestroy(world);
    }
}

namespace {

std::vector<dContactGeom> sweptContacts(dGeomID a, dGeomID b, dReal step) {
  std::vector<dContactGeom> contacts(4);
  contacts.resize(static_cast<std::size_t>(
      dParallelSAPCollideSwept(a, b, step, 4, contacts.data(), sizeof(dContactGeom))));
  return contacts;
}

// What might be disturbed.
std::vector<dReal> stateOf(dGeomID geom) {
  const Bounds box = boundsOf(geom);
  std::vector<dReal> state(box.begin(), box.end());
  state.insert(state.end(), dGeomGetPosition(geom), dGeomGetPosition(geom) + 3);
  state.insert(state.end(), dGeomGetRotation(geom), dGeomGetRotation(geom) + 12);
  return state;
}

}  // namespace

TEST_CASE("A swept contact says how far geoms come until they touch, and leaves them as they are",
          "[swept]") {
  const dReal step = real(0.01), infinity = std::numeric_limits<dReal>::infinity();
  for (const bool offset : {false, true})
    for (const bool swept : {false, true}) {
      const Space space;
      World world(space);
      const dGeomID floor = dCreateBox(space, 90, 90, 2),
                    ball = world.take(dCreateSphere(space, 1));
      const dBodyID body = world.giveBody(ball);
      dBodySetPosition(body, 3, 0, 11);
      if (offset) dGeomSetOffsetPosition(ball, 0, 1, 0);
      if (swept) dParallelSAPSpaceSetSweptBounds(space, step);
      INFO("offset " << offset << ", swept " << swept);
      const auto check = [&](dReal down, dReal aside, std::size_t count, double depth) {
        dBodySetLinearVel(body, aside / step, 0, -down / step);
        (void)collide(space);
        const std::vector<dReal> before = stateOf(ball);
        for (const bool first : {false, true}) {
          const auto found =
              first ? sweptContacts(floor, ball, step) : sweptContacts(ball, floor, step);
          REQUIRE(found.size() == count);
          if (count == 0) continue;
          CHECK(double(found[0].depth) == Approx(depth).margin(1e-4));
          CHECK(double(found[0].normal[2]) == Approx(first ? -1 : 1));
          // It stops a body that falls, and turns none.
          if (down > 1) CHECK(double(found[0].pos[0]) == Approx(3));
        }
        CHECK(stateOf(ball) == before);
      };
      check(8, 0, 0, 0);  // down to 1 m above the floor
      check(10, 0, 1, -9);
      check(500, 77, 1, -9);
      check(infinity, 0, 0, 0);
      dBodySetPosition(body, 3, 0, real(1.9));
      check(1, 0, 1, 0.1);  // no more than half of its size
      check(9, 0, 1, 0.1);
      check(0, 9, 1, 0.1);
      dBodyDisable(body);
      dBodySetPosition(body, 3, 0, 11);
      check(10, 0, 0, 0);
    }
}

TEST_CASE("Swept contacts of all shapes may be asked for while spaces are locked", "[swept]") {
  const std::uint64_t seed = seedOr(5);
  const Space space;
  Twins twins(space, geomsOf(150), seed);
  dParallelSAPSpaceSetSweptBounds(space, real(0.05));
  std::size_t found = 0;
  for (int frame = 0; frame < 16; ++frame) {
    INFO("frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    twins.change(frame);
    dSpaceCollide(space, &found, [](void* data, dGeomID a, dGeomID b) {
      const auto hasConvex = [](dGeomID geom) { return dGeomGetClass(geom) == dConvexClass; };
      const auto hasMesh = [](dGeomID geom) { return dGeomGetClass(geom) == dTriMeshClass; };
      if ((hasConvex(a) && hasMesh(b)) || (hasMesh(a) && hasConvex(b))) return;  // ODE asserts
      const std::vector<dReal> before[] = {stateOf(a), stateOf(b)};
      *static_cast<std::size_t*>(data) += sweptContacts(a, b, real(0.05)).size();
      const std::vector<dReal> after[] = {stateOf(a), stateOf(b)};
      for (int i = 0; i < 2; ++i)  // by their bits: some are no numbers
        REQUIRE(!std::memcmp(before[i].data(), after[i].data(), before[i].size() * sizeof(dReal)));
    });
  }
  CHECK(found > 0);
}
