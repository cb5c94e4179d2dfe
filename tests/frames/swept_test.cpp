// Swept bounds: boxes are what the header says, and pairs are those of these boxes.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "support/bounds.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/random.h"
#include "support/recorder.h"

using namespace sap_test;

namespace {

dReal lengthOf(dReal x, dReal y, dReal z) {
  return std::sqrt(x * x + y * y + z * z);
}

// A geom of the space under test, and another like it that lies beside it in no space.
class Mover {
 public:
  Mover(dSpaceID space, dWorldID world, std::size_t number, Random& random)
      : kind_(number % 5), random_(random.bits()) {
    size_ = real(random.between(0.2, 1.5));
    geom = make(space, size_);
    plain_ = make(nullptr, size_);
    setNumber(geom, number);
    if (number % 7 == 3) return;  // without a body
    body_ = dBodyCreate(world);
    dBodySetGravityMode(body_, 0);
    dGeomSetBody(geom, body_);
    offset_ = number % 11 == 5;
    if (offset_) dGeomSetOffsetPosition(geom, real(0.5), real(-0.25), 1);
  }
  ~Mover() {
    dGeomDestroy(geom);
    dGeomDestroy(plain_);
    if (body_) dBodyDestroy(body_);
  }
  Mover(const Mover&) = delete;
  Mover& operator=(const Mover&) = delete;

  void move(double side) {
    const dReal x = number(0, side), y = number(0, side), z = number(0, side);
    dMatrix3 rotation;
    dRFromEulerAngles(rotation, x, y, z);
    dGeomSetPosition(geom, x, y, z);
    dGeomSetRotation(geom, rotation);
  }
  void push(double speed) {
    if (!body_) return;
    const double much = random_.chance(0.3) ? 0 : speed;
    dBodySetLinearVel(body_, number(-much, much), number(-much, much), number(-much, much));
    const double spin = random_.chance(0.5) ? 0 : speed;
    dBodySetAngularVel(body_, number(-spin, spin), number(-spin, spin), number(-spin, spin));
  }
  void sleepOrWake() {
    if (body_) random_.chance(0.5) ? dBodyEnable(body_) : dBodyDisable(body_);
  }
  bool chance(double probability) { return random_.chance(probability); }
  dBodyID body() const { return body_; }

  // As it lies.
  Bounds plain() const {
    const dReal* const at = dGeomGetPosition(geom);
    dGeomSetPosition(plain_, at[0], at[1], at[2]);
    dGeomSetRotation(plain_, dGeomGetRotation(geom));
    return boundsOf(plain_);
  }
  // By which what turns moves no point further.
  dReal turned(dReal step) const {
    if (!body_ || !dBodyIsEnabled(body_)) return 0;
    const dReal* const w = dBodyGetAngularVel(body_);
    const dReal angle = std::min(lengthOf(w[0], w[1], w[2]) * step, dReal(2));
    const dReal* const b = dBodyGetPosition(body_);
    const dReal* const at = dGeomGetPosition(geom);
    const Bounds box = plain();
    dReal arm[3];
    for (int i = 0; i < 3; ++i) {
      arm[i] = kind_ == 1 ? at[i] - b[i]
                          : std::max(std::fabs(b[i] - box[std::size_t(2 * i)]),
                                     std::fabs(box[std::size_t(2 * i + 1)] - b[i]));
    }
    return angle > 0 ? angle * lengthOf(arm[0], arm[1], arm[2]) : 0;
  }
  // By which no point of it moves further.
  dReal reach(dReal step) const {
    if (!body_ || !dBodyIsEnabled(body_)) return 0;
    const dReal* const v = dBodyGetLinearVel(body_);
    return lengthOf(v[0] * step, v[1] * step, v[2] * step) + turned(step);
  }
  dReal smallestSide() const {
    switch (kind_) {
      case 0:
        return size_ / 4;
      case 2:
        return 2 * (size_ / 4);
      case 3:
        return size_ / 4;
      default:
        return size_;
    }
  }
  // The header's formula.
  Bounds swept(dReal step) const {
    Bounds box = plain();
    if (!body_ || !dBodyIsEnabled(body_) || step == 0) return box;
    const dReal turn = turned(step);
    const dReal* const v = dBodyGetLinearVel(body_);
    for (std::size_t i = 0; i < 3; ++i) {
      const dReal d = v[i] * step;
      box[2 * i] += std::min(d, dReal(0)) - turn;
      box[2 * i + 1] += std::max(d, dReal(0)) + turn;
    }
    return box;
  }

  dGeomID geom;

 private:
  dReal number(double low, double high) { return real(random_.between(low, high)); }

  dGeomID make(dSpaceID space, dReal size) const {
    switch (kind_) {
      case 0:
        return dCreateBox(space, size, size / 2, size / 4);
      case 1:
        return dCreateSphere(space, size / 2);
      case 2:
        return dCreateCapsule(space, size / 4, size);
      case 3:
        return dCreateCylinder(space, size / 2, size / 4);
      default:
        return dCreateBox(space, size, size, size);
    }
  }

  std::size_t kind_;
  dReal size_;
  Random random_;
  dGeomID plain_;
  dBodyID body_ = nullptr;
  bool offset_ = false;
};

// A space with movers.
class Crowd {
 public:
  Crowd(dSpaceID space, std::size_t size, std::uint64_t seed)
      : world_(dWorldCreate()), space_(space), random_(seed), side_(2.2 * std::cbrt(double(size))) {
    for (std::size_t i = 0; i < size; ++i) add();
  }
  ~Crowd() {
    movers.clear();
    dWorldDestroy(world_);
  }
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

  void add() {
    movers.push_back(std::make_unique<Mover>(space_, world_, next_++, random_));
    movers.back()->move(side_);
    movers.back()->push(20);
  }
  // What a frame does: all geoms move, some do, some only get another speed, sleep or wake, or
  // leave.
  void change(int frame) {
    for (const auto& mover : movers) {
      if (frame % 4 == 0 || mover->chance(0.05)) mover->move(side_);
      if (mover->chance(frame % 4 == 1 ? 0 : 0.1)) mover->push(20);
      if (mover->chance(0.05)) mover->sleepOrWake();
    }
    if (frame % 3 != 2) return;
    // One leaves, or so many that the slots of the others are closed up.
    const std::size_t size = movers.size();
    for (std::size_t i = frame % 8 == 5 ? size * 4 / 5 : 1; i > 0; --i)
      movers.erase(movers.begin() + static_cast<std::ptrdiff_t>(random_.below(movers.size())));
    while (movers.size() < size) add();
  }
  Pairs pairs(dReal step) const {
    std::vector<Bounds> boxes;
    for (const auto& mover : movers) boxes.push_back(mover->swept(step));
    Pairs pairs;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t j = i + 1; j < boxes.size(); ++j) {
        if (overlap(boxes[i], boxes[j])) {
          pairs.emplace_back(number(movers[i]->geom), number(movers[j]->geom));
        }
      }
    }
    return pairs;
  }

  std::vector<std::unique_ptr<Mover>> movers;

 private:
  dWorldID world_;
  dSpaceID space_;
  Random random_;
  double side_;
  std::size_t next_ = 0;
};

// Steps that are on, off, other ones.
dReal stepOf(int frame) {
  return frame % 8 == 6 ? 0 : real(frame % 8 == 7 ? 0.05 : 0.02);
}

}  // namespace

TEST_CASE("A swept box is what the header says, bit for bit", "[swept]") {
  const std::uint64_t seed = seedOr(5);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  const Space space(configurations()[0]);
  Crowd crowd(space, 60, seed);
  int larger = 0;
  for (int frame = 0; frame < 24; ++frame) {
    crowd.change(frame);
    const dReal step = stepOf(frame);
    dParallelSAPSpaceSetSweptBounds(space, step);
    collide(space);
    for (const auto& mover : crowd.movers) {
      CHECK(boundsOf(mover->geom) == mover->swept(step));
      if (mover->swept(step) != mover->plain()) ++larger;
    }
  }
  CHECK(larger > 500);
}

TEST_CASE("With swept bounds every configuration finds exactly the pairs of swept boxes",
          "[swept]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t size : {std::size_t{40}, std::size_t{180}, geomsOf(900)}) {
      for (const int threads : {0, 3}) {
        const std::uint64_t seed = seedOr(size);
        INFO(configuration.name << ", " << size << " geoms, " << threads
                                << " threads, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        const Space space(configuration);
        dParallelSAPSpaceSetNumThreads(space, threads);
        Crowd crowd(space, size, seed);
        std::size_t more = 0;
        for (int frame = 0; frame < 16; ++frame) {
          crowd.change(frame);
          dParallelSAPSpaceSetSweptBounds(space, stepOf(frame));
          const Pairs expected = crowd.pairs(stepOf(frame)), plain = crowd.pairs(0);
          CAPTURE(frame);
          REQUIRE(difference(collide(space), expected) == "");
          REQUIRE(std::includes(expected.begin(), expected.end(), plain.begin(), plain.end()));
          more += expected.size() - plain.size();
        }
        CHECK(more > size);
      }
    }
  }
}

TEST_CASE("With swept bounds a tolerance adds pairs and takes none away", "[swept]") {
  const Space space(configurations()[0]);
  Crowd crowd(space, 500, seedOr(9));
  dParallelSAPSpaceSetTolerance(space, real(0.3));
  dParallelSAPSpaceSetSweptBounds(space, real(0.02));
  for (int frame = 0; frame < 12; ++frame) {
    if (frame % 3 == 0) crowd.change(frame);
    const Pairs expected = crowd.pairs(real(0.02)), got = collide(space);
    CHECK(std::includes(got.begin(), got.end(), expected.begin(), expected.end()));
  }
}

TEST_CASE("Blocks, events and contacts go by swept boxes, too", "[swept]") {
  for (const std::size_t size : {std::size_t{60}, geomsOf(600)}) {
    const Space space(configurations()[0]);
    Crowd crowd(space, size, seedOr(11));
    const dReal step = real(0.02);
    dParallelSAPSpaceSetSweptBounds(space, step);
    dParallelSAPSpaceSetEvents(space, 1);
    Pairs blocks;
    dParallelSAPSpaceCollidePairs(
        space, &blocks, 0,
        [](void* data, const dParallelSAPPair* pairs, std::size_t count, std::size_t) {
          for (std::size_t i = 0; i < count; ++i) record(data, pairs[i].o1, pairs[i].o2);
        });
    CHECK(difference(blocks, crowd.pairs(step)) == "");
    // No geom moves; speeds end.
    for (const auto& mover : crowd.movers) mover->push(0);
    struct Asked {
      static int flags(void* data, dGeomID a, dGeomID b) {
        record(data, a, b);
        return 1;
      }
      static void contacts(void*, dGeomID, dGeomID, const dContactGeom*, int) {}
    };
    dParallelSAPContactCallbacks callbacks = {&Asked::contacts, &Asked::flags, nullptr, nullptr};
    dParallelSAPSpaceSetNumThreads(space, 1);
    Pairs asked;
    dParallelSAPSpaceCollideContacts(space, &asked, 1, &callbacks);
    CHECK(difference(sorted(asked), crowd.pairs(0)) == "");
    const dParallelSAPPairEvent* ended = nullptr;
    CHECK(dParallelSAPSpaceGetEndedPairs(space, &ended) == blocks.size() - asked.size());
  }
}

TEST_CASE("dSpaceCollide2 finds what overlaps swept boxes, and comes with the swept box",
          "[swept]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t size : {std::size_t{40}, geomsOf(700)}) {
      INFO(configuration.name << ", " << size << " geoms");
      const Space space(configuration), other(configuration);
      Crowd crowd(space, size, seedOr(13));
      const dReal step = real(0.02);
      const dGeomID probe = dCreateSphere(other, 1);
      const dWorldID world = dWorldCreate();
      const dBodyID body = dBodyCreate(world);
      dGeomSetBody(probe, body);
      setNumber(probe, 1000000);
      dParallelSAPSpaceSetSweptBounds(space, step);
      dParallelSAPSpaceSetSweptBounds(other, step);
      for (int query = 0; query < 40; ++query) {
        crowd.change(query);
        // Always in one place, so that only its speed changes.
        if (query == 0) dBodySetPosition(body, 2, 2, 2);
        dBodySetLinearVel(body, real(10 * query), 0, real(-5 * query));
        const Pairs got = collide2(space, probe);
        Bounds box = {1, 3, 1, 3, 1, 3};
        box[1] += real(10 * query) * step;
        box[4] -= real(5 * query) * step;
        Pairs expected;
        for (const auto& mover : crowd.movers) {
          if (overlap(mover->swept(step), box)) {
            expected.emplace_back(number(mover->geom), 1000000);
          }
        }
        CAPTURE(query);
        REQUIRE(difference(got, expected) == "");
      }
      dBodyDestroy(body);
      dWorldDestroy(world);
    }
  }
}

TEST_CASE("What leaves a swept space, or is swept no more, has its own box again", "[swept]") {
  const Space space(configurations()[0]);
  const dWorldID world = dWorldCreate();
  const dGeomID left = dCreateSphere(space, 1), stays = dCreateSphere(space, 1);
  for (const dGeomID geom : {left, stays}) {
    const dBodyID body = dBodyCreate(world);
    dGeomSetBody(geom, body);
    dBodySetLinearVel(body, 5, 0, 0);
  }
  const Bounds plain = {-1, 1, -1, 1, -1, 1}, swept = {-1, 6, -1, 1, -1, 1};
  dParallelSAPSpaceSetSweptBounds(space, 1);
  collide(space);
  CHECK(boundsOf(left) == swept);
  dSpaceRemove(space, left);
  CHECK(boundsOf(left) == plain);
  CHECK(boundsOf(stays) == swept);
  dGeomSetBody(stays, nullptr);
  collide(space);
  CHECK(boundsOf(stays) == plain);
  dSpaceAdd(space, left);
  collide(space);
  CHECK(boundsOf(left) == swept);
  dParallelSAPSpaceSetSweptBounds(space, 0);
  collide(space);
  CHECK(boundsOf(left) == plain);
  dGeomDestroy(left);
  dWorldDestroy(world);
}

TEST_CASE("Speeds that are infinite or no number leave no geom out", "[swept]") {
  const dReal infinity = std::numeric_limits<dReal>::infinity();
  const dReal nan = std::numeric_limits<dReal>::quiet_NaN();
  const Space space(configurations()[0]);
  const dWorldID world = dWorldCreate();
  const dBodyID body = dBodyCreate(world);
  const dGeomID ball = dCreateBox(space, 2, 2, 2), wall = dCreateSphere(space, 1);
  setNumber(ball, 1);
  setNumber(wall, 2);
  dGeomSetBody(ball, body);
  dGeomSetPosition(wall, 1000, 0, 0);
  dParallelSAPSpaceSetSweptBounds(space, 1);
  dBodySetLinearVel(body, infinity, nan, -1);
  CHECK(collide(space) == Pairs{{1, 2}});
  CHECK(boundsOf(ball) == Bounds{-1, infinity, -1, 1, -2, 1});
  dBodySetLinearVel(body, 0, 0, 0);
  dBodySetAngularVel(body, nan, 0, 0);
  CHECK(collide(space) == Pairs());
  dBodySetAngularVel(body, infinity, 0, 0);
  collide(space);
  CHECK(boundsOf(ball)[1] == 1 + 2 * std::sqrt(dReal(3)));
  dWorldDestroy(world);
}

TEST_CASE("Fast is what may move by more than half its smallest side", "[swept]") {
  const std::uint64_t seed = seedOr(17);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  const Space space(configurations()[0]), other(configurations()[0]);
  Crowd crowd(space, 300, seed);
  const dReal step = real(0.02);
  int fast = 0, slow = 0;
  for (int frame = 0; frame < 7; ++frame) {
    crowd.change(frame);
    dParallelSAPSpaceSetSweptBounds(space, step);
    collide(space);
    for (const auto& mover : crowd.movers) {
      const dReal size = mover->smallestSide();
      const bool expected = mover->reach(step) > size / 2;
      ++(expected ? fast : slow);
      CHECK(dParallelSAPSpaceIsFast(space, mover->geom) == expected);
      CHECK(dParallelSAPSpaceIsFast(other, mover->geom) == 0);
    }
  }
  CHECK(fast > 100);
  CHECK(slow > 100);
  dParallelSAPSpaceSetSweptBounds(space, 0);
  collide(space);
  for (const auto& mover : crowd.movers) CHECK(!dParallelSAPSpaceIsFast(space, mover->geom));
}
