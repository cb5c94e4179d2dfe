#include "moving_scene.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rules_oracle.h"
#include "scenes.h"
#include "user_box.h"

namespace sap_test {
namespace {

bool isFixed(dGeomID geom) {
  return dGeomGetClass(geom) == dPlaneClass || dGeomIsSpace(geom);
}

void turn(dGeomID geom, double angle) {
  dMatrix3 rotation, turned;
  dRFromAxisAndAngle(rotation, 1, 2, 3, real(angle));
  dMultiply0_333(turned, rotation, dGeomGetRotation(geom));
  dGeomSetRotation(geom, turned);
}

int mayTouchMost(dGeomID self, dGeomID other, dReal*) {
  return (number(self) ^ number(other)) % 4 != 0;
}

}  // namespace

MovingScene::MovingScene(const Configuration& configuration, std::size_t n, std::uint64_t seed,
                         Kinds kinds)
    : space_(configuration),
      random_(seed),
      seed_(seed),
      kinds_(kinds),
      most_(n + n / 2),
      reach_(std::cbrt(static_cast<double>(n))) {
  add(dCreatePlane(space_, 0, 0, 1, 0));
  add(dCreatePlane(space_, dReal(0.6), 0, dReal(0.8), 0));
  while (order_.size() < n) addAny();
}

MovingScene::~MovingScene() {
  if (outside_) dGeomDestroy(outside_);
  while (!order_.empty()) destroy(order_.back());
  dWorldDestroy(world_);
}

std::string MovingScene::wrong(const Pairs& pairs) const {
  return wrongByRules(Rules::of(space_), order_, pairs);
}

void MovingScene::moveSome(double part) {
  std::size_t moves =
      static_cast<std::size_t>(part * static_cast<double>(order_.size()) + random_.unit());
  for (; moves > 0; --moves) {
    const dGeomID geom = any();
    random_.chance(0.1) ? place(geom) : shift(geom, 0.3);
  }
}

void MovingScene::drift(double distance) {
  for (const dGeomID geom : order_) {
    Random way(seed_ + number(geom));
    if (isFixed(geom) || way.chance(0.1)) continue;
    const double x = way.between(-1, 1), y = way.between(-1, 1), z = way.between(-1, 1);
    shift(geom, sense_ * distance * x, sense_ * distance * y, sense_ * distance * z);
    if (random_.chance(0.1)) turn(geom, distance);
  }
  for (const dGeomID geom : inside_) shift(geom, sense_ * distance, 0, 0);
}

void MovingScene::tremble(double distance) {
  for (const std::vector<dGeomID>* const geoms : {&order_, &inside_})
    for (const dGeomID geom : *geoms) shift(geom, distance);
}

void MovingScene::edit() {
  dGeomID geom = any();
  const dBodyID body = dGeomGetBody(geom);
  switch (random_.below(15)) {
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
      setBody(geom, nullptr);
      break;
    case 4:
      setBody(geom, dGeomGetBody(any()));
      break;
    case 5:
      if (body) dBodyDisable(body);
      break;
    case 6:
      if (body) dBodyEnable(body);
      break;
    case 7:
      geom = leaveOrReturn(geom);
      break;
    case 8:
      resize(geom);
      break;
    case 9:
      makeIll(geom);
      break;
    case 10:  // the last one's slot is another's then
      geom = replace(order_.back());
      break;
    case 11:
      geom = replace(geom);
      break;
    case 12:
      dSpaceClean(space_);
      break;
    case 13:
      (void)collide2(space_, geom);
      break;
    case 14:
      editInside();
      break;
  }
  if (telling_ && geom) tell(geom);
}

void MovingScene::promise() {
  dParallelSAPSpaceSetNotified(space_, 1);
  telling_ = true;
}

dGeomID MovingScene::any() {
  return order_[random_.below(order_.size())];
}

unsigned long MovingScene::anyBits() {
  const unsigned long upper = 1ul << (8 * sizeof(unsigned long) - 24);
  const auto below = [this](std::size_t n) { return static_cast<unsigned long>(random_.below(n)); };
  const unsigned long choices[] = {~0ul, ~0ul, 1ul << below(3), below(8), upper * below(8), ~upper};
  return choices[random_.below(6)];
}

void MovingScene::add(dGeomID geom) {
  setNumber(geom, next_++);
  order_.push_back(geom);
}

dGeomID MovingScene::make() {
  const std::size_t kind = random_.below(8);
  if (kind < 2) return dCreateSphere(space_, real(random_.between(0.2, 0.6)));
  if (kind == 2) return dCreateBox(space_, dReal(0.2), dReal(0.2), 4);
  if (kind == 3) {
    const dReal half = dReal(0.5);
    return createUserBox(space_, {-half, half, -half, half, -half, half}, true,
                         kinds_.wild ? mayTouchMost : nullptr);
  }
  const Shape& shape = shapes()[random_.below(shapes().size())];
  const bool tests = shape.name == std::string("user class with AABBTest");
  if (kind == 4 && kinds_.all && shape.placeable && (kinds_.wild || !tests))
    return shape.create(space_);
  return dCreateBox(space_, 1, 1, 1);
}

void MovingScene::addAny() {
  if (random_.chance(0.02)) return addSubSpace();
  const dGeomID geom = make();
  add(geom);
  place(geom);
  if (random_.chance(0.5)) dGeomSetCategoryBits(geom, 1ul << random_.below(3));
  if (random_.chance(0.5)) dGeomSetCollideBits(geom, random_.below(8));
  if (random_.chance(0.3)) return;
  if (random_.chance(0.3)) return setBody(geom, dGeomGetBody(any()));
  const dBodyID body = dBodyCreate(world_);
  const dReal* const at = dGeomGetPosition(geom);
  dBodySetPosition(body, at[0], at[1], at[2]);
  setBody(geom, body);
}

void MovingScene::addSubSpace() {
  const std::size_t kind = random_.below(3);
  const dSpaceID inner = kind == 0   ? dSimpleSpaceCreate(space_)
                         : kind == 1 ? dHashSpaceCreate(space_)
                                     : dParallelSAPSpaceCreate(space_);
  add(asGeom(inner));
  for (std::size_t i = random_.below(4); i > 0; --i) addInside(inner);
}

void MovingScene::addInside(dSpaceID space) {
  inside_.push_back(dCreateSphere(space, dReal(0.5)));
  setNumber(inside_.back(), next_++);
  place(inside_.back());
}

void MovingScene::place(dGeomID geom) {
  if (isFixed(geom)) return;
  const double x = random_.between(0, reach_), y = random_.between(0, reach_);
  dGeomSetPosition(geom, real(kinds_.offset + x), real(y), real(random_.between(0, reach_)));
}

void MovingScene::shift(dGeomID geom, double dx, double dy, double dz) {
  dVector3 at;
  dGeomCopyPosition(geom, at);
  dGeomSetPosition(geom, at[0] + real(dx), at[1] + real(dy), at[2] + real(dz));
}

void MovingScene::shift(dGeomID geom, double distance) {
  const double dx = random_.between(-distance, distance);
  const double dy = random_.between(-distance, distance);
  if (!isFixed(geom)) shift(geom, dx, dy, random_.between(-distance, distance));
}

void MovingScene::setBody(dGeomID geom, dBodyID body) {
  if (isFixed(geom)) return;
  if (dGeomIsOffset(geom)) dGeomClearOffset(geom);  // or ODE leaks its position
  dGeomSetBody(geom, body);
  if (body && random_.chance(0.2)) dGeomSetOffsetPosition(geom, dReal(0.25), 0, dReal(-0.5));
}

void MovingScene::resize(dGeomID geom) {
  const dReal size = real(random_.chance(0.1) ? 0 : random_.between(0.2, 1));
  const bool infinite = kinds_.wild && random_.chance(0.1);
  if (dGeomGetClass(geom) == dSphereClass)
    dGeomSphereSetRadius(geom, infinite ? std::numeric_limits<dReal>::infinity() : size);
  if (dGeomGetClass(geom) == dBoxClass) dGeomBoxSetLengths(geom, size, 1, 1);
}

// No number or infinite, until the next one falls ill.
void MovingScene::makeIll(dGeomID geom) {
  const int kind = dGeomGetClass(geom);
  if (!kinds_.wild || (kind != dSphereClass && kind != dBoxClass)) return;
  dVector3 at;
  if (ill_) {
    dGeomCopyPosition(ill_, at);
    dGeomSetPosition(ill_, at[0], at[1], was_);
  }
  dGeomCopyPosition(geom, at);
  was_ = std::isfinite(at[2]) ? at[2] : 0;
  ill_ = geom;
  using Limits = std::numeric_limits<dReal>;
  dGeomSetPosition(geom, at[0], at[1],
                   random_.chance(0.5) ? Limits::quiet_NaN() : Limits::infinity());
}

void MovingScene::editInside() {
  if (inside_.empty()) return;
  const std::size_t i = random_.below(inside_.size());
  if (random_.chance(0.7)) return place(inside_[i]);
  const dSpaceID space = dGeomGetSpace(inside_[i]);
  if (random_.chance(0.3)) {  // a stock space does not say that it comes anew
    dSpaceRemove(space, inside_[i]);
    dSpaceAdd(space, inside_[i]);
    if (dSpaceIsParallelSAP(space)) setNumber(inside_[i], next_++);
    return;
  }
  dGeomDestroy(inside_[i]);
  inside_.erase(inside_.begin() + static_cast<std::ptrdiff_t>(i));
  if (random_.chance(0.5)) addInside(space);  // at the same address, mostly
}

void MovingScene::destroy(dGeomID geom) {
  if (geom == ill_) ill_ = nullptr;
  const auto isWithin = [geom](dGeomID other) { return asGeom(dGeomGetSpace(other)) == geom; };
  inside_.erase(std::remove_if(inside_.begin(), inside_.end(), isWithin), inside_.end());
  order_.erase(std::find(order_.begin(), order_.end(), geom));
  dGeomDestroy(geom);
}

// One goes, and often others come, planes among them; returns the last of these.
dGeomID MovingScene::replace(dGeomID geom) {
  destroy(geom);
  if (random_.chance(0.1))
    add(dCreatePlane(space_, dReal(0.6), 0, dReal(0.8), real(random_.between(-5, 5))));
  while (order_.size() < kPlanes + 3 || (order_.size() < most_ && random_.chance(0.5))) addAny();
  return order_.back();
}

// One leaves the space and comes back at once or with another edit, by another number: pairs are
// told apart by when their geoms were added. Returns who came back.
dGeomID MovingScene::leaveOrReturn(dGeomID geom) {
  const dGeomID returning = std::exchange(outside_, nullptr);
  if (returning) {
    dSpaceAdd(space_, returning);
    add(returning);
    return returning;
  }
  dSpaceRemove(space_, geom);
  order_.erase(std::find(order_.begin(), order_.end(), geom));
  outside_ = geom;
  return random_.chance(0.5) ? leaveOrReturn(geom) : nullptr;
}

// Of all geoms at times, or of those that any change of this one may have changed.
void MovingScene::tell(dGeomID geom) {
  if (random_.chance(0.1)) return dParallelSAPSpaceNotify(space_, nullptr);
  dParallelSAPSpaceNotify(space_, geom);
  const dBodyID body = dGeomGetBody(geom);
  for (dGeomID on = body ? dBodyGetFirstGeom(body) : nullptr; on; on = dBodyGetNextGeom(on))
    if (on != outside_) dParallelSAPSpaceNotify(space_, on);
}

}  // namespace sap_test
