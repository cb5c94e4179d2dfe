#include "user_box.h"

#include <atomic>

namespace sap_test {

namespace {

std::atomic<unsigned long> asked{0};
std::atomic<void (*)()> observer{nullptr};

void boundsOf(dGeomID geom, dReal aabb[6]) {
  ++asked;
  if (void (*const observe)() = observer) observe();
  const UserBoxData& data = userBoxData(geom);
  const dReal* position = dGeomGetPosition(geom);
  for (int i = 0; i < 6; ++i) {
    aabb[i] = data.relative ? data.bounds[i] + position[i / 2] : data.bounds[i];
  }
}

int testOf(dGeomID self, dGeomID other, dReal aabb[6]) {
  const Veto veto = userBoxData(self).veto;
  return veto ? veto(self, other, aabb) : 1;
}

dColliderFn* noCollider(int) {
  return nullptr;
}

int createClass(dAABBTestFn* test) {
  dGeomClass description = {};
  description.bytes = sizeof(UserBoxData);
  description.collider = noCollider;
  description.aabb = boundsOf;
  description.aabb_test = test;
  return dCreateGeomClass(&description);
}

int testedClass() {
  static const int number = createClass(testOf);
  return number;
}

int plainClass() {
  static const int number = createClass(nullptr);
  return number;
}

dGeomID create(int class_number, dSpaceID space, const UserBoxData& data) {
  const dGeomID geom = dCreateGeom(class_number);
  userBoxData(geom) = data;
  if (space) dSpaceAdd(space, geom);
  return geom;
}

}  // namespace

dGeomID createUserBox(dSpaceID space, const Bounds& bounds, bool relative, Veto veto) {
  return create(testedClass(), space, UserBoxData{bounds, relative, veto, 0});
}

dGeomID createUserBoxWithoutTest(dSpaceID space, const Bounds& bounds) {
  return create(plainClass(), space, UserBoxData{bounds, false, nullptr, 0});
}

void setUserBounds(dGeomID user_box, const Bounds& bounds) {
  userBoxData(user_box).bounds = bounds;
  dVector3 position;
  dGeomCopyPosition(user_box, position);
  dGeomSetPosition(user_box, position[0], position[1], position[2]);
}

bool isUserBox(dGeomID geom) {
  const int type = dGeomGetClass(geom);
  return type == testedClass() || type == plainClass();
}

UserBoxData& userBoxData(dGeomID user_box) {
  return *static_cast<UserBoxData*>(dGeomGetClassData(user_box));
}

unsigned long userBoundsAsked() {
  return asked;
}

void setUserBoundsObserver(void (*new_observer)()) {
  observer = new_observer;
}

}  // namespace sap_test
