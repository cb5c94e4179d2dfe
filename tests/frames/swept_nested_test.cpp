// Swept bounds of spaces within others: boxes of sub-spaces follow in spaces of ours, and stock
// spaces around them are left as they are.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "support/bounds.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/random.h"
#include "support/recorder.h"

using namespace sap_test;

namespace {

constexpr dReal kStep = 0.5;
constexpr dReal kRadius = 0.5;
constexpr std::size_t kWalls = 1000;  // the first number of one

void include(Bounds& box, const Bounds& other) {
  for (std::size_t i = 0; i < 6; i += 2) {
    box[i] = std::min(box[i], other[i]);
    box[i + 1] = std::max(box[i + 1], other[i + 1]);
  }
}

// A sphere with a body that does not turn.
class Ball {
 public:
  Ball(dSpaceID space, dWorldID world, std::size_t number) : body(dBodyCreate(world)) {
    geom = dCreateSphere(space, kRadius);
    dBodySetGravityMode(body, 0);
    dGeomSetBody(geom, body);
    setNumber(geom, number);
  }
  void move(Random& random, double side) {
    dBodySetPosition(body, real(random.between(0, side)), real(random.between(0, side)), 0);
  }
  void push(Random& random) {
    dBodySetLinearVel(body, real(random.between(-9, 9)), real(random.between(-9, 9)), 0);
  }
  // The header's formula.
  Bounds swept(dReal step) const {
    const dReal* const at = dBodyGetPosition(body);
    const dReal* const v = dBodyGetLinearVel(body);
    Bounds box;
    for (std::size_t i = 0; i < 3; ++i) {
      const dReal d = dBodyIsEnabled(body) ? v[i] * step : 0;
      box[2 * i] = at[i] - kRadius;
      box[2 * i + 1] = at[i] + kRadius;
      box[2 * i] += std::min(d, dReal(0));
      box[2 * i + 1] += std::max(d, dReal(0));
    }
    return box;
  }

  dBodyID body;
  dGeomID geom;
};

// Walls in a space.
class Walls {
 public:
  Walls(dSpaceID space, std::size_t count, double side, Random& random) {
    for (std::size_t i = 0; i < count; ++i) {
      geoms.push_back(dCreateBox(space, 1, 1, 1));
      dGeomSetPosition(geoms.back(), real(random.between(0, side)), real(random.between(0, side)),
                       0);
      setNumber(geoms.back(), kWalls + i);
    }
  }
  std::vector<dGeomID> geoms;
};

// The space around a swept one.
struct Around {
  const char* name;
  dSpaceID (*create)(dSpaceID parent);  // null: none
  dSpaceID (*innermost)(dSpaceID parent);
};
const Around kOurs[] = {{"none", nullptr, nullptr},
                        {"ours", dParallelSAPSpaceCreate, nullptr},
                        {"ours in ours", dParallelSAPSpaceCreate, dParallelSAPSpaceCreate}};
const Around kAround[] = {{"none", nullptr, nullptr},
                          {"simple", dSimpleSpaceCreate, nullptr},
                          {"hash", dHashSpaceCreate, nullptr},
                          {"ours", dParallelSAPSpaceCreate, nullptr},
                          {"simple in hash", dHashSpaceCreate, dSimpleSpaceCreate},
                          {"simple in ours", dParallelSAPSpaceCreate, dSimpleSpaceCreate},
                          {"ours in simple", dSimpleSpaceCreate, dParallelSAPSpaceCreate}};

// A swept space with balls, and what is around it within `parent`.
class Nest {
 public:
  Nest(dSpaceID parent, const Around& around, dWorldID world, std::size_t count,
       std::size_t first_number) {
    dSpaceID within = parent;
    for (const auto create : {around.create, around.innermost}) {
      if (!create) continue;
      within = create(within);
      if (!outermost) outermost = within;
    }
    swept = dParallelSAPSpaceCreate(within);
    if (!outermost) outermost = swept;
    dParallelSAPSpaceSetSweptBounds(swept, kStep);
    for (std::size_t i = 0; i < count; ++i) balls.emplace_back(swept, world, first_number + i);
  }
  Bounds box() const {
    Bounds box = balls[0].swept(kStep);
    for (const Ball& ball : balls) include(box, ball.swept(kStep));
    return box;
  }

  dSpaceID outermost = nullptr;
  dSpaceID swept;
  std::vector<Ball> balls;
};

// What a program may do with a nest before what is around it is collided.
void disturb(const Nest& nest, dSpaceID other, Random& random) {
  const Ball& ball = nest.balls[random.below(nest.balls.size())];
  switch (random.below(9)) {
    case 0:
      boundsOf(asGeom(nest.swept));
      break;
    case 1:
      boundsOf(asGeom(nest.outermost));
      break;
    case 2:
      boundsOf(ball.geom);
      break;
    case 3:
      collide2(asGeom(nest.outermost), asGeom(other));
      break;
    case 4:
      collide2(other, ball.geom);
      break;
    case 5:
      collide2(other, asGeom(nest.swept));
      break;
    case 6:
      collide(nest.swept);
      break;
    case 7:
      dSpaceClean(nest.swept);
      break;
    default:
      dSpaceClean(nest.outermost);
  }
}

void change(Ball ball, double side, Random& random) {
  if (random.chance(0.3)) ball.move(random, side);
  if (random.chance(0.6)) ball.push(random);
  if (random.chance(0.2)) {
    random.chance(0.7) ? dBodyEnable(ball.body) : dBodyDisable(ball.body);
  }
}

// The pairs of boxes, in the order of both.
Pairs pairsOf(const std::vector<std::pair<std::size_t, Bounds>>& boxes) {
  Pairs pairs;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = i + 1; j < boxes.size(); ++j)
      if (overlap(boxes[i].second, boxes[j].second))
        pairs.emplace_back(boxes[i].first, boxes[j].first);
  return pairs;
}

// Takes pairs with spaces apart, and collides these spaces, too.
void takeApart(void* data, dGeomID a, dGeomID b) {
  if (!dGeomIsSpace(a) && !dGeomIsSpace(b)) return record(data, a, b);
  dSpaceCollide2(a, b, data, takeApart);
  for (const dGeomID geom : {a, b})
    if (dGeomIsSpace(geom)) dSpaceCollide(reinterpret_cast<dSpaceID>(geom), data, takeApart);
}

}  // namespace

TEST_CASE("Boxes of sub-spaces follow their swept geoms, whatever was asked before",
          "[swept_nested]") {
  const double side = 30;
  for (const Configuration& configuration : configurations()) {
    for (const Around& around : kOurs) {
      const std::uint64_t seed = seedOr(3);
      INFO(configuration.name << ", " << around.name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      Random random(seed);
      const dWorldID world = dWorldCreate();
      const Space outer(configuration), other(configuration);
      std::vector<Nest> nests;
      for (std::size_t i = 0; i < 5; ++i) {
        nests.emplace_back(outer, around, world, 2, 10 * i);
        setNumber(asGeom(nests.back().outermost), i);
        for (Ball& ball : nests.back().balls) ball.move(random, side);
      }
      const Walls walls(outer, 12, side, random), others(other, 7, side, random);
      for (int frame = 0; frame < 60; ++frame) {
        for (const Nest& nest : nests) {
          for (int i = 0; i < 2; ++i) {
            if (random.chance(0.5)) change(nest.balls[random.below(2)], side, random);
            if (random.chance(0.5)) disturb(nest, other, random);
          }
        }
        std::vector<std::pair<std::size_t, Bounds>> boxes;
        for (const Nest& nest : nests)
          boxes.emplace_back(number(asGeom(nest.outermost)), nest.box());
        for (const dGeomID wall : walls.geoms) boxes.emplace_back(number(wall), boundsOf(wall));
        CAPTURE(frame);
        if (frame % 4 == 3) {
          // What a query finds is that, too.
          const dGeomID wall = others.geoms[0];
          Pairs expected;
          for (const auto& box : boxes)
            if (overlap(box.second, boundsOf(wall))) expected.emplace_back(box.first, kWalls);
          REQUIRE(difference(collide2(outer, wall), expected) == "");
        }
        REQUIRE(difference(collide(outer), pairsOf(boxes)) == "");
        for (const Nest& nest : nests) REQUIRE(boundsOf(asGeom(nest.outermost)) == nest.box());
      }
      dWorldDestroy(world);
    }
  }
}

TEST_CASE("dSpaceCollide2 of a stock space reports each pair of its swept sub-spaces once",
          "[swept_nested]") {
  const double side = 15;
  for (const Around& around : kOurs) {
    for (const auto create : {dSimpleSpaceCreate, dHashSpaceCreate}) {
      INFO(around.name);
      Random random(seedOr(7));
      const dWorldID world = dWorldCreate();
      const Space other(configurations()[0]);
      const Walls walls(other, 20, side, random);
      const dSpaceID stock = create(nullptr);
      std::vector<Nest> nests;
      for (std::size_t i = 0; i < 6; ++i) {
        nests.emplace_back(stock, around, world, 2, 10 * i);
        setNumber(asGeom(nests.back().outermost), i);
        for (Ball& ball : nests.back().balls) ball.move(random, side);
      }
      for (int frame = 0; frame < 20; ++frame) {
        if (frame % 5 == 1) collide(stock);
        // Speeds only: no space is told of them.
        for (Nest& nest : nests)
          for (Ball& ball : nest.balls) ball.push(random);
        Pairs expected;
        for (const Nest& nest : nests)
          for (const dGeomID wall : walls.geoms)
            if (overlap(nest.box(), boundsOf(wall)))
              expected.emplace_back(number(asGeom(nest.outermost)), number(wall));
        CAPTURE(frame);
        REQUIRE(difference(asSet(collide2(stock, asGeom(other))), expected) == "");
      }
      dSpaceDestroy(stock);
      dWorldDestroy(world);
    }
  }
}

TEST_CASE("A stock space around swept ones misses no pair of geoms as they lie", "[swept_nested]") {
  const double side = 12;
  for (const Around& around : kAround) {
    for (const auto create : {dSimpleSpaceCreate, dHashSpaceCreate}) {
      INFO(around.name);
      Random random(seedOr(11));
      const dWorldID world = dWorldCreate();
      const dSpaceID stock = create(nullptr);
      std::vector<Ball> balls;
      for (std::size_t i = 0; i < 4; ++i) {
        const Nest nest(stock, around, world, 2, 10 * i);
        balls.insert(balls.end(), nest.balls.begin(), nest.balls.end());
        balls.emplace_back(stock, world, 100 + i);
      }
      for (Ball& ball : balls) ball.move(random, side);
      std::size_t found = 0;
      for (int frame = 0; frame < 60; ++frame) {
        for (Ball& ball : balls) {
          if (random.chance(0.2)) ball.move(random, side);
          if (random.chance(0.2)) ball.push(random);
        }
        Pairs pairs;
        dSpaceCollide(stock, &pairs, takeApart);
        pairs = asSet(pairs);
        const std::set<Pair> got(pairs.begin(), pairs.end());
        CAPTURE(frame);
        for (const Ball& a : balls) {
          for (const Ball& b : balls) {
            if (number(a.geom) >= number(b.geom) || !overlap(a.swept(0), b.swept(0))) continue;
            // Pairs within a nest come up where the nest itself is in one.
            if (number(a.geom) / 10 == number(b.geom) / 10 && number(a.geom) < 100) continue;
            REQUIRE(got.count({number(a.geom), number(b.geom)}) == 1);
            ++found;
          }
        }
      }
      CHECK(found > 20);
      dSpaceDestroy(stock);
      dWorldDestroy(world);
    }
  }
}
