// Frames in which all moves, but slowly: cells that are kept from frame to frame must not show.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr double slow = 0.001;  // of a width in a frame: little for the thin bars, too

// Boxes, spheres, bars and user boxes, with and without bodies, that drift each in its own
// direction among a ground plane, an oblique one and boxes that stand still.
class DriftingScene {
 public:
  DriftingScene(const Configuration& configuration, std::size_t n, double offset,
                std::uint64_t seed)
      : space_(configuration), world_(space_), random_(seed) {
    reach_ = std::cbrt(static_cast<double>(n));
    add(dCreatePlane(space_, 0, 0, 1, offset));
    add(dCreatePlane(space_, 0.6, 0, 0.8, offset));
    for (std::size_t i = 2; i < n; ++i) {
      add(anyShape());
      dGeomSetPosition(order_.back(), offset + anywhere(), anywhere(), anywhere());
      if (random_.chance(0.6)) world_.giveBody(order_.back());
      if (random_.chance(0.3)) dGeomSetCategoryBits(order_.back(), 1ul << random_.below(3));
    }
    ways_.resize(n);
    for (Way& way : ways_)
      if (random_.chance(0.9))
        for (double& speed : way.speed) speed = random_.between(-1, 1);
  }

  dSpaceID space() const { return space_; }
  std::size_t size() const { return order_.size(); }
  const std::vector<dGeomID>& order() const { return order_; }

  void drift(double distance) {
    for (const dGeomID geom : order_) {
      const Way& way = ways_[number(geom)];
      if (isPlane(geom) || way.stands()) continue;
      const dReal* const place = dGeomGetPosition(geom);
      const dReal x = place[0], y = place[1], z = place[2];
      dGeomSetPosition(geom, x + distance * way.speed[0], y + distance * way.speed[1],
                       z + distance * way.speed[2]);
      if (random_.chance(0.1)) turn(geom, distance);
    }
  }
  void turnBack() {
    for (Way& way : ways_)
      for (double& speed : way.speed) speed = -speed;
  }

  // What programs do between frames, to a few geoms.
  void edit() {
    const dGeomID geom = order_[2 + random_.below(order_.size() - 2)];
    const dReal* const place = dGeomGetPosition(geom);
    switch (random_.below(8)) {
      case 0:
        dGeomSetPosition(geom, place[0] + random_.between(-2, 2), place[1], place[2]);
        break;
      case 1:
        dGeomIsEnabled(geom) ? dGeomDisable(geom) : dGeomEnable(geom);
        break;
      case 2:
        dGeomSetCollideBits(geom, random_.chance(0.5) ? ~0ul : random_.below(8));
        break;
      case 3:
        dGeomSetBody(geom, nullptr);
        break;
      case 4:
        if (const dBodyID body = dGeomGetBody(order_[2 + random_.below(order_.size() - 2)]))
          dGeomSetBody(geom, body);
        break;
      case 5:
        dSpaceRemove(space_, geom);
        dSpaceAdd(space_, geom);
        order_.erase(std::find(order_.begin(), order_.end(), geom));
        order_.push_back(geom);
        break;
      case 6:
        if (dGeomGetClass(geom) == dSphereClass) dGeomSphereSetRadius(geom, 0.2 + random_.unit());
        break;
      case 7:
        heal();
        ill_ = geom;
        was_ = place[2];
        dGeomSetPosition(geom, place[0], place[1],
                         random_.chance(0.5) ? std::numeric_limits<dReal>::quiet_NaN()
                                             : std::numeric_limits<dReal>::infinity());
        break;
    }
  }

 private:
  struct Way {
    double speed[3] = {0, 0, 0};
    bool stands() const { return speed[0] == 0; }
  };

  static bool isPlane(dGeomID geom) { return dGeomGetClass(geom) == dPlaneClass; }
  double anywhere() { return random_.between(0, reach_); }
  void add(dGeomID geom) { order_.push_back(world_.take(geom)); }
  dGeomID anyShape() {
    switch (random_.below(4)) {
      case 0:
        return dCreateSphere(space_, random_.between(0.2, 0.6));
      case 1:
        return dCreateBox(space_, 0.2, 0.2, 4);
      case 2:
        return createUserBox(space_, {-0.5, 0.5, -0.5, 0.5, -0.5, 0.5}, true,
                             [](dGeomID self, dGeomID other, dReal*) {
                               return static_cast<int>((number(self) ^ number(other)) % 4 != 0);
                             });
      default:
        return dCreateBox(space_, 1, 1, 1);
    }
  }
  void turn(dGeomID geom, double angle) {
    dMatrix3 rotation, turned;
    dRFromAxisAndAngle(rotation, 1, 2, 3, angle);
    dMultiply0_333(turned, rotation, dGeomGetRotation(geom));
    dGeomSetRotation(geom, turned);
  }
  void heal() {
    if (!ill_) return;
    const dReal* const place = dGeomGetPosition(ill_);
    dGeomSetPosition(ill_, place[0], place[1], was_);
  }

  Space space_;
  World world_;
  Random random_;
  std::vector<dGeomID> order_;
  std::vector<Way> ways_;
  double reach_;
  dGeomID ill_ = nullptr;
  dReal was_ = 0;
};

}  // namespace

TEST_CASE("While all drifts, the pairs of every frame are those of the formula", "[drifting]") {
  const std::uint64_t seed = seedOr(81);
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {80, 800})
      for (const double offset : {0.0, 3e4}) {
        DriftingScene scene(configuration, n, offset, seed);
        Random random(seed);
        for (int frame = 0; frame < scaled(70); ++frame) {
          INFO(configuration.name << ", seed " << seed << ", " << n << " geoms, offset " << offset
                                  << ", frame " << frame);
          const Pairs pairs = collide(scene.space());
          REQUIRE(difference(pairs, expectedPairs(scene.order())) == "");
          if (frame % 16 == 15) scene.turnBack();
          if (random.chance(0.8)) scene.drift(random.chance(0.1) ? 0.2 : slow);
          while (frame > 10 && random.chance(0.5)) scene.edit();
        }
      }
}

TEST_CASE("Settings may change while all drifts", "[drifting]") {
  const std::uint64_t seed = seedOr(82);
  for (const int threads : {1, 3}) {
    DriftingScene scene(Configuration{dParallelSAPBackendCPU, dParallelSAPMethodAuto, "auto"}, 900,
                        0, seed);
    Random random(seed);
    dParallelSAPSpaceSetNumThreads(scene.space(), threads);
    for (int frame = 0; frame < scaled(120); ++frame) {
      INFO("seed " << seed << ", " << threads << " threads, frame " << frame);
      const Pairs pairs = collide(scene.space());
      const bool exact = dParallelSAPSpaceGetTolerance(scene.space()) == 0;
      Pairs expected = expectedPairs(scene.order());
      if (exact) {
        REQUIRE(difference(pairs, expected) == "");
      } else {
        REQUIRE(std::includes(pairs.begin(), pairs.end(), expected.begin(), expected.end()));
      }
      scene.drift(slow);
      if (frame % 8 != 7) continue;
      switch (random.below(3)) {
        case 0:
          dParallelSAPSpaceSetTolerance(scene.space(), exact ? 0.05 : 0);
          break;
        case 1:
          dParallelSAPSpaceSetMethod(scene.space(), random.chance(0.5)
                                                        ? dParallelSAPMethodBruteForce
                                                        : dParallelSAPMethodAuto);
          break;
        case 2:
          (void)collide2(scene.space(), scene.order()[5]);
          break;
      }
    }
  }
}

TEST_CASE("Where all drifts every frame is found anew, and statistics say so", "[drifting]") {
  for (const double side : {14.0, 3.0}) {  // the smaller one is a crowd
    Space space;
    World world(space);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
    Random random(83);
    for (int i = 0; i < 1500; ++i) {
      const dGeomID box = world.take(dCreateBox(space, 1, 1, 1));
      dGeomSetPosition(box, random.between(0, side), random.between(0, side),
                       random.between(0, side));
    }
    for (int frame = 0; frame < 12; ++frame) {
      INFO("side " << side << ", frame " << frame);
      world.jitter(0.001, frame);
      const Pairs pairs = collide(space);
      REQUIRE(difference(pairs, expectedPairs(world.geoms())) == "");
      const dParallelSAPStats stats = statsOf(space);
      CHECK(stats.pairs == pairs.size());
      CHECK(stats.moved == 1500);
      CHECK(stats.kept == 0);
    }
    // What stands still keeps its pairs.
    const Pairs pairs = collide(space);
    CHECK(difference(collide(space), pairs) == "");
    CHECK(statsOf(space).moved == 0);
    CHECK(statsOf(space).kept == pairs.size());
  }
}

TEST_CASE("What moved a little is seen where the space was clean before", "[drifting]") {
  Space space;
  World world(space);
  dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
  world.addBoxes(denseCube(1500, 86));
  for (int frame = 0; frame < 24; ++frame) {
    INFO("frame " << frame);
    world.jitter(0.002, frame);
    if (frame % 2) dSpaceClean(space);
    REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
    CHECK(statsOf(space).moved == (frame % 2 ? 0 : 1500));
  }
}

TEST_CASE("Culled planes and pairs at rest are exact while all drifts", "[drifting]") {
  const std::uint64_t seed = seedOr(85);
  DriftingScene swept(Configuration{dParallelSAPBackendCPU, dParallelSAPMethodAuto, "auto"}, 900, 0,
                      seed);
  DriftingScene anew(Configuration{dParallelSAPBackendCPU, dParallelSAPMethodBruteForce, "anew"},
                     900, 0, seed);
  for (DriftingScene* scene : {&swept, &anew}) {
    dParallelSAPSpaceSetCullPlanes(scene->space(), 1);
    dParallelSAPSpaceSetSkipStatic(scene->space(), 1);
  }
  for (int frame = 0; frame < scaled(50); ++frame) {
    INFO("seed " << seed << ", frame " << frame);
    const Pairs pairs = collide(swept.space());
    REQUIRE(pairs.size() > 0);
    REQUIRE(difference(pairs, collide(anew.space())) == "");
    for (DriftingScene* scene : {&swept, &anew}) scene->drift(slow);
  }
}

TEST_CASE("A culled plane in the slot of a geom as large is no geom as large", "[drifting]") {
  for (const double tolerance : {0.0, 0.05}) {
    Space space;
    World world(space);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
    dParallelSAPSpaceSetCullPlanes(space, 1);
    dParallelSAPSpaceSetTolerance(space, tolerance);
    world.addBoxes(denseCube(1500, 87));
    const auto pairsOfLast = [&](dGeomID last) {
      setNumber(last, 1500);
      world.jitter(0.001, 1);
      const Pairs pairs = collide(space);
      return std::count_if(pairs.begin(), pairs.end(),
                           [](const Pair& pair) { return pair.second == 1500; });
    };
    dGeomID last = dCreateSphere(space, std::numeric_limits<dReal>::infinity());
    for (int frame = 0; frame < 6; ++frame) CHECK(pairsOfLast(last) == 1500);
    dGeomDestroy(last);
    last = dCreatePlane(space, 0.6, 0, 0.8, -100);
    for (int frame = 0; frame < 3; ++frame) CHECK(pairsOfLast(last) == 0);
    CHECK((statsOf(space).kept > 0) == (tolerance > 0));
    dGeomDestroy(last);
  }
}

TEST_CASE("Boxes beyond the range of floats drift like others", "[drifting]") {
  Space space;
  World world(space);
  dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
  world.addBoxes(denseCube(1500, 88));
  for (int i = 1; i <= 20; ++i) {
    const dGeomID far = world.take(dCreateBox(space, 1e30, 1e30, 1e30));
    dGeomSetPosition(far, 1e39 * i, 0, 0);
    world.giveBody(far);
  }
  for (int frame = 0; frame < 12; ++frame) {
    world.jitter(0.001, frame);
    REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
  }
}
