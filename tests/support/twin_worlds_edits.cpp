// What may happen to the three worlds.
#include "twin_worlds.h"
#include "user_box.h"

namespace sap_test {

void TwinWorlds::edit() {
  switch (random_.below(20)) {
    case 0:
      createLeaf();
      break;
    case 1:
      replaceLeaf();
      break;
    case 2:
      removeSomething();
      break;
    case 3:
      reAdd();
      break;
    case 4:
      moveBetweenSpaces();
      break;
    case 5:
      changeBody();
      break;
    case 6:
      changeOffset();
      break;
    case 7:
      changeBits();
      break;
    case 8:
      changeSize();
      break;
    case 9:
      switchSomething();
      break;
    case 10:
      changeSpaceSettings();
      break;
    case 11:
      if (random_.chance(0.3)) destroyBody();
      break;
    case 12:
      if (random_.chance(0.3)) createSpaceInside();
      break;
    case 13:
      onlyLook();
      break;
    case 14:
    case 15:
      turnSomething();
      break;
    default:
      moveSomething();
  }
}

void TwinWorlds::replaceLeaf() {
  const int leaf = pick([](const Object& o) { return o.kind != kSpace; });
  if (leaf != kNone) destroy(leaf);
  createLeaf();
}

void TwinWorlds::removeSomething() {
  const int object = pick([](const Object& o) { return o.parent != kNone; });
  if (object != kNone) remove(object);
}

void TwinWorlds::switchSomething() {
  const int object = pick([](const Object&) { return true; });
  const bool enable = random_.chance(0.6);
  log((enable ? "enable " : "disable ") + std::to_string(object));
  for (const dGeomID geom : objects_[object].in) (enable ? dGeomEnable : dGeomDisable)(geom);
}

void TwinWorlds::moveSomething() {
  const int body = pickBody();
  const dReal x = coordinate(), y = coordinate(), z = height();
  if (body != kNone && random_.chance(0.5)) {
    log("move body " + std::to_string(body));
    for (const dBodyID b : bodies_[body].in) dBodySetPosition(b, x, y, z);
    return;
  }
  const int object = pick([](const Object& o) { return o.kind < kPlane; });
  if (object == kNone) return;
  log("move geom " + std::to_string(object));
  for (const dGeomID geom : objects_[object].in) dGeomSetPosition(geom, x, y, z);
}

void TwinWorlds::turnSomething() {
  const int object = pick([](const Object& o) { return o.kind < kPlane; });
  if (object == kNone) return;
  dMatrix3 rotation;
  const dReal a = coordinate(), b = coordinate(), c = coordinate();
  dRFromEulerAngles(rotation, a, b, c);
  log("turn " + std::to_string(object));
  for (const dGeomID geom : objects_[object].in) dGeomSetRotation(geom, rotation);
}

void TwinWorlds::changeBody() {
  const int object = pick([](const Object& o) { return o.kind < kPlane; });
  if (object == kNone) return;
  Object& o = objects_[object];
  int body = pickBody();
  if (body == kNone || random_.chance(0.3)) body = createBody();
  if (random_.chance(0.3)) body = kNone;
  if (o.offset && body != o.body) {
    // dGeomSetBody (geom, another body) would leak the offset geom's own position.
    for (const dGeomID geom : o.in) dGeomClearOffset(geom);
    o.offset = false;
  }
  log("body of " + std::to_string(object) + " becomes " + std::to_string(body));
  for (int world = 0; world < kWorlds; ++world) {
    dGeomSetBody(o.in[world], body == kNone ? nullptr : bodies_[body].in[world]);
  }
  o.body = body;
}

void TwinWorlds::changeOffset() {
  const int object = pick([](const Object& o) { return o.body != kNone; });
  if (object == kNone) return;
  Object& o = objects_[object];
  const std::size_t what = random_.below(3);
  const dReal x = coordinate() / 3, y = coordinate() / 3, z = coordinate() / 3;
  dMatrix3 rotation;
  dRFromEulerAngles(rotation, x, y, z);
  log("offset " + std::to_string(what) + " of " + std::to_string(object));
  for (const dGeomID geom : o.in) {
    if (what == 0) dGeomClearOffset(geom);
    if (what == 1) dGeomSetOffsetPosition(geom, x, y, z);
    if (what == 2) dGeomSetOffsetRotation(geom, rotation);
  }
  o.offset = what != 0;
}

void TwinWorlds::changeBits() {
  const int object = pick([](const Object&) { return true; });
  const unsigned long bits = random_.chance(0.4) ? ~0ul : random_.below(8);
  const bool category = random_.chance(0.5);
  log("bits of " + std::to_string(object));
  for (const dGeomID geom : objects_[object].in) {
    if (category) {
      dGeomSetCategoryBits(geom, bits);
    } else {
      dGeomSetCollideBits(geom, bits);
    }
  }
}

void TwinWorlds::changeSize() {
  const int object = pick([](const Object& o) { return o.kind < kLeafKinds; });
  if (object == kNone) return;
  Object& o = objects_[object];
  const dReal a = size(), b = size(), c = size();
  if (o.kind == kPlane) o.plane[3] = o.plane[2] > 0 ? height() : coordinate();
  log("size of " + std::to_string(object));
  for (const dGeomID geom : o.in) {
    switch (o.kind) {
      case kSphere:
        dGeomSphereSetRadius(geom, a / 2);
        break;
      case kBox:
        dGeomBoxSetLengths(geom, a, b, c);
        break;
      case kCapsule:
        dGeomCapsuleSetParams(geom, a / 2, b);
        break;
      case kCylinder:
        dGeomCylinderSetParams(geom, a / 2, b);
        break;
      case kRay:
        dGeomRaySetLength(geom, a + b);
        break;
      case kPlane:
        dGeomPlaneSetParams(geom, o.plane[0], o.plane[1], o.plane[2], o.plane[3]);
        break;
      default:
        // What this geom says of itself changes, and ODE is told by a move to where it is. On a
        // body that is done exactly only by moving the body.
        userBoxData(geom).bounds = {-a / 2, a / 2, -b / 2, b / 2, -c / 2, c / 2};
    }
  }
  if (o.kind == kUser) {
    for (int world = 0; world < kWorlds; ++world) makeDirty(object, world);
  }
}

void TwinWorlds::destroyBody() {
  const int body = pickBody();
  if (body == kNone) return;
  log("destroy body " + std::to_string(body));
  for (const dBodyID b : bodies_[body].in) dBodyDestroy(b);
  bodies_[body].alive = false;
  for (Object& o : objects_) {
    if (o.alive && o.body == body) {
      o.body = kNone;
      o.offset = false;
    }
  }
}

void TwinWorlds::reAdd() {
  const int object = pick([](const Object& o) { return o.parent != kNone; });
  if (object == kNone) return;
  const int parent = objects_[object].parent;
  remove(object);
  add(object, parent);
}

void TwinWorlds::moveBetweenSpaces() {
  const int object = pick([](const Object&) { return true; });
  const int target = pick([](const Object& o) { return o.kind == kSpace; });
  if (object <= 1 || target == kNone || isInside(target, object)) return;
  if (objects_[object].parent != kNone) remove(object);
  add(object, target);
}

void TwinWorlds::changeSpaceSettings() {
  const int chosen = pick([](const Object& o) { return o.kind == kSpace; });
  if (chosen == kNone) return;
  const std::size_t what = random_.below(4);
  const int value = static_cast<int>(random_.below(3));
  log("setting " + std::to_string(what) + " of space " + std::to_string(chosen) + ": " +
      std::to_string(value));
  if (what == 3 && chosen > 1) {
    destroy(chosen);
    return;
  }
  for (int world = 0; world < kWorlds; ++world) {
    if (what == 0) dSpaceSetSublevel(space(chosen, world), value);
    if (what == 1) dSpaceSetCleanup(space(chosen, world), value != 0);
    if (what == 2) dSpaceClean(space(chosen, world));
  }
  if (what == 1) objects_[chosen].cleans_up = value != 0;
}

// Calls that change nothing that a caller can see.
void TwinWorlds::onlyLook() {
  const int object = pick([](const Object&) { return true; });
  log("look at " + std::to_string(object));
  for (int world = 0; world < kWorlds; ++world) {
    dReal bounds[6];
    dGeomGetAABB(objects_[object].in[world], bounds);
    if (objects_[object].kind == kSpace && random_.chance(0.5)) collide(space(object, world));
  }
}

}  // namespace sap_test
