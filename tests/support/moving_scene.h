// A crowd of everything that moves in every way and changes in every way, most of them without a
// word to the space.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "configurations.h"
#include "random.h"
#include "recorder.h"
#include "rules_oracle.h"
#include "user_box.h"

namespace sap_test {

class MovingScene {
 public:
  // Two planes, boxes, spheres, bars and user boxes, most with bodies, around x = offset.
  MovingScene(const Configuration& configuration, std::size_t n, std::uint64_t seed,
              double offset = 0)
      : space_(configuration),
        random_(seed),
        seed_(seed),
        offset_(offset),
        most_(n + n / 2),
        reach_(std::cbrt(static_cast<double>(n))) {
    add(dCreatePlane(space_, 0, 0, 1, 0));
    add(dCreatePlane(space_, 0.6, 0, 0.8, 0));
    while (order_.size() < n) addAny();
  }
  ~MovingScene() {
    if (outside_) dGeomDestroy(outside_);
    for (const dGeomID geom : order_) dGeomDestroy(geom);
    dWorldDestroy(world_);
  }
  MovingScene(const MovingScene&) = delete;
  MovingScene& operator=(const MovingScene&) = delete;

  dSpaceID space() const { return space_; }
  const std::vector<dGeomID>& order() const { return order_; }  // of adding
  // "" or what is wrong about the pairs of the frame, by the rules that are set.
  std::string wrong(const Pairs& pairs) const {
    return wrongByRules(Rules::of(space_), order_, pairs);
  }

  // About this part of the geoms moves a little way, some of them anywhere.
  void moveSome(double part) {
    std::size_t moves =
        static_cast<std::size_t>(part * static_cast<double>(order_.size()) + random_.unit());
    for (; moves > 0; --moves) {
      const dGeomID geom = any();
      random_.chance(0.1) ? place(geom) : shift(geom, 0.3);
    }
  }
  // Each in a direction of its own, but a tenth that stands; some turn.
  void drift(double distance) {
    for (std::size_t i = kPlanes; i < order_.size(); ++i) {
      const dGeomID geom = order_[i];
      Random way(seed_ + number(geom));
      if (isPlane(geom) || way.chance(0.1)) continue;
      const double x = way.between(-1, 1), y = way.between(-1, 1), z = way.between(-1, 1);
      shift(geom, sense_ * distance * x, sense_ * distance * y, sense_ * distance * z);
      if (random_.chance(0.1)) turn(geom, distance);
    }
  }
  void turnBack() { sense_ = -sense_; }
  // Each anywhere within a distance.
  void tremble(double distance) {
    for (std::size_t i = kPlanes; i < order_.size(); ++i)
      if (!isPlane(order_[i])) shift(order_[i], distance);
  }

  // One of the things that programs do between frames.
  void edit() {
    dGeomID geom = any();
    const dBodyID body = dGeomGetBody(geom);
    switch (random_.below(14)) {
      case 0:
        dGeomIsEnabled(geom) ? dGeomDisable(geom) : dGeomEnable(geom);
        break;
      case 1:
        dGeomSetCategoryBits(geom, anyBits());
        break;
      case 2:
        dGeomSetCollideBits(geom, anyBits());
        break;
      case 3:
        if (!isPlane(geom)) dGeomSetBody(geom, nullptr);
        break;
      case 4:
        if (!isPlane(geom)) dGeomSetBody(geom, dGeomGetBody(any()));
        break;
      case 5:
        if (body) dBodyDisable(body);
        break;
      case 6:
        if (body) dBodyEnable(body);
        break;
      case 7:  // at once, or with another edit
        if (outside_) geom = addAgain(std::exchange(outside_, nullptr));
        if (order_.size() < kPlanes + 3) break;
        take(geom);
        if (random_.chance(0.5)) {
          outside_ = geom;
          return;
        }
        addAgain(geom);
        break;
      case 8:
        if (dGeomGetClass(geom) != dSphereClass) break;
        dGeomSphereSetRadius(geom, random_.chance(0.1) ? std::numeric_limits<dReal>::infinity()
                                                       : random_.between(0.2, 1));
        break;
      case 9:
        makeIll(geom);
        break;
      case 10:
        replaceLast();
        geom = order_.back();
        break;
      case 11:
        dSpaceClean(space_);
        break;
      case 12:
        (void)collide2(space_, geom);
        break;
      case 13:
        replaceAny(geom);
        geom = order_.back();
        break;
    }
    if (telling_) tell(geom);
  }
  // From now on the space is told of what changes without a word.
  void promise() {
    dParallelSAPSpaceSetNotified(space_, 1);
    telling_ = true;
  }

 private:
  static constexpr std::size_t kPlanes = 2;

  static bool isPlane(dGeomID geom) { return dGeomGetClass(geom) == dPlaneClass; }
  dGeomID any() { return order_[kPlanes + random_.below(order_.size() - kPlanes)]; }
  unsigned long anyBits() {
    const unsigned long upper = 1ul << (8 * sizeof(unsigned long) - 24);
    const unsigned long choices[] = {~0ul,  ~0ul,  1ul << random_.below(3), random_.below(8),
                                     upper, ~upper};
    return choices[random_.below(6)];
  }

  void add(dGeomID geom) {
    setNumber(geom, next_++);
    order_.push_back(geom);
  }
  void addAny() {
    switch (random_.below(5)) {
      case 0:
        add(dCreateSphere(space_, random_.between(0.2, 0.6)));
        break;
      case 1:
        add(dCreateBox(space_, 0.2, 0.2, 4));
        break;
      case 2:
        add(createUserBox(space_, {-0.5, 0.5, -0.5, 0.5, -0.5, 0.5}, true,
                          [](dGeomID self, dGeomID other, dReal*) {
                            return static_cast<int>((number(self) ^ number(other)) % 4 != 0);
                          }));
        break;
      default:
        add(dCreateBox(space_, 1, 1, 1));
    }
    const dGeomID geom = order_.back();
    place(geom);
    if (random_.chance(0.5)) dGeomSetCategoryBits(geom, 1ul << random_.below(3));
    if (random_.chance(0.5)) dGeomSetCollideBits(geom, random_.below(8));
    if (random_.chance(0.3)) return;
    if (random_.chance(0.3)) return dGeomSetBody(geom, dGeomGetBody(any()));
    const dBodyID body = dBodyCreate(world_);
    const dReal* const at = dGeomGetPosition(geom);
    dBodySetPosition(body, at[0], at[1], at[2]);
    dGeomSetBody(geom, body);
  }
  void place(dGeomID geom) {
    if (isPlane(geom)) return;
    const double x = random_.between(0, reach_), y = random_.between(0, reach_);
    dGeomSetPosition(geom, offset_ + x, y, random_.between(0, reach_));
  }
  void shift(dGeomID geom, double dx, double dy, double dz) {
    dVector3 at;
    dGeomCopyPosition(geom, at);
    dGeomSetPosition(geom, at[0] + dx, at[1] + dy, at[2] + dz);
  }
  void shift(dGeomID geom, double distance) {
    const double dx = random_.between(-distance, distance);
    const double dy = random_.between(-distance, distance);
    if (!isPlane(geom)) shift(geom, dx, dy, random_.between(-distance, distance));
  }
  static void turn(dGeomID geom, double angle) {
    dMatrix3 rotation, turned;
    dRFromAxisAndAngle(rotation, 1, 2, 3, angle);
    dMultiply0_333(turned, rotation, dGeomGetRotation(geom));
    dGeomSetRotation(geom, turned);
  }
  void take(dGeomID geom) {
    dSpaceRemove(space_, geom);
    order_.erase(std::find(order_.begin(), order_.end(), geom));
  }
  // Has another number then: pairs are told apart by when their geoms were added.
  dGeomID addAgain(dGeomID geom) {
    dSpaceAdd(space_, geom);
    add(geom);
    return geom;
  }
  // One goes, and often others come.
  void replaceAny(dGeomID geom) {
    if (geom == ill_) ill_ = nullptr;
    dGeomDestroy(geom);
    order_.erase(std::find(order_.begin(), order_.end(), geom));
    while (order_.size() < most_ && random_.chance(0.55)) addAny();
    if (order_.size() < kPlanes + 3) addAny();
  }
  // The last one goes; often another comes into its slot, which may be a plane.
  void replaceLast() {
    if (order_.size() <= kPlanes + 3) return;
    if (ill_ == order_.back()) ill_ = nullptr;
    dGeomDestroy(order_.back());
    order_.pop_back();
    if (random_.chance(0.3))
      add(dCreatePlane(space_, 0.6, 0, 0.8, random_.between(-5, 5)));
    else if (random_.chance(0.9))
      addAny();
  }
  // No number or infinite, until the next one falls ill.
  void makeIll(dGeomID geom) {
    if (isPlane(geom)) return;
    dVector3 at;
    if (ill_) {
      dGeomCopyPosition(ill_, at);
      dGeomSetPosition(ill_, at[0], at[1], was_);
    }
    dGeomCopyPosition(geom, at);
    was_ = std::isfinite(at[2]) ? at[2] : 0;
    ill_ = geom;
    dGeomSetPosition(geom, at[0], at[1],
                     random_.chance(0.5) ? std::numeric_limits<dReal>::quiet_NaN()
                                         : std::numeric_limits<dReal>::infinity());
  }
  // Of all geoms at times, or of those that any change of this one may have changed.
  void tell(dGeomID geom) {
    if (random_.chance(0.1)) return dParallelSAPSpaceNotify(space_, nullptr);
    dParallelSAPSpaceNotify(space_, geom);
    const dBodyID body = dGeomGetBody(geom);
    for (dGeomID on = body ? dBodyGetFirstGeom(body) : nullptr; on; on = dBodyGetNextGeom(on))
      if (on != outside_) dParallelSAPSpaceNotify(space_, on);
  }

  const Space space_;
  const dWorldID world_ = dWorldCreate();
  Random random_;
  const std::uint64_t seed_;
  const double offset_;
  const std::size_t most_;
  const double reach_;
  double sense_ = 1;
  std::vector<dGeomID> order_;
  std::size_t next_ = 0;
  dGeomID outside_ = nullptr, ill_ = nullptr;
  dReal was_ = 0;
  bool telling_ = false;
};

}  // namespace sap_test
