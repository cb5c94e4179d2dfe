// What the driver does to the world between collides.
#include "driver.h"

namespace sap_test {
namespace {

constexpr std::size_t kMostBodies = 400;

}  // namespace

const Driver::Change Driver::kChanges[Driver::kNumChanges] = {
    {"destroy", 1, &Driver::destroyLeaf},
    {"replace", 1, &Driver::replaceLeaf},
    {"add again", 1, &Driver::leaveAndReturn},
    {"move", 4, &Driver::place},
    {"turn", 1, &Driver::turn},
    {"resize", 1, &Driver::resize},
    {"give bodies to", 4, &Driver::giveBody},
    {"push", 1, &Driver::push},
    {"offset", 3, &Driver::changeOffset},
    {"change bits of", 6, &Driver::changeBits},
    {"enable or disable", 3, &Driver::changeEnabled},
    {"look at", 1, &Driver::lookAt},
    {"change unasked", 1, &Driver::changeUnasked},
};

// Some geoms of a space, all in one way.
void Driver::changeSome(const Change& change) {
  const int space = pickSpace();
  Random random = decisions_.random();
  const std::size_t way = decisions_.below(change.ways);
  log(std::string(change.name) + " some of " + std::to_string(space) + ", way " +
      std::to_string(way));
  for (const int object : pickSome(space, random)) {
    (this->*change.make)(object, way, random);
    tell(object);
    ++changes_;
  }
}

void Driver::changeAnyhow(int object, Random& random) {
  const Change& change = kChanges[random.below(kNumChanges)];
  const std::size_t way = random.below(change.ways);
  (this->*change.make)(object, way, random);
  tell(object);
  ++changes_;
}

// Of bits, bodies and enabled states ODE tells no space.
void Driver::tell(int object) const {
  const Object& o = objects_[object];
  if (o.geom && o.parent != kNone && objects_[o.parent].ours)
    dParallelSAPSpaceNotify(spaceOf(o.parent), o.geom);
}

void Driver::tellOfAll() const {
  for (const int space : spaces_)
    if (objects_[space].ours) dParallelSAPSpaceNotify(spaceOf(space), nullptr);
}

void Driver::destroyLeaf(int object, std::size_t, Random&) {
  if (objects_[object].kind != kSpace) destroy(object);
}

void Driver::replaceLeaf(int object, std::size_t, Random& random) {
  const int space = objects_[object].parent;
  if (objects_[object].kind == kSpace) return;
  destroy(object);
  const int leaf = createLeaf(random.chance(0.5) ? kBox : kSphere, random);
  place(leaf, 0, random);
  add(leaf, space);
}

void Driver::leaveAndReturn(int object, std::size_t, Random&) {
  addAgain(object);
}

void Driver::turn(int object, std::size_t, Random& random) {
  if (objects_[object].kind >= kPlane) return;
  dMatrix3 rotation;
  const double a = random.between(-3, 3), b = random.between(-3, 3);
  dRFromEulerAngles(rotation, real(a), real(b), real(random.between(-3, 3)));
  dGeomSetRotation(objects_[object].geom, rotation);
}

void Driver::resize(int object, std::size_t, Random& random) {
  const dGeomID geom = objects_[object].geom;
  const dReal a = randomLength(random), b = randomLength(random), c = randomLength(random);
  switch (objects_[object].kind) {
    case kBox:
      dGeomBoxSetLengths(geom, a, b, c);
      break;
    case kSphere:
      dGeomSphereSetRadius(geom, a / 2);
      break;
    case kCapsule:
      dGeomCapsuleSetParams(geom, a / 2, b);
      break;
    case kCylinder:
      dGeomCylinderSetParams(geom, a / 2, b);
      break;
    case kUser:
      userBoxData(geom).bounds = randomBounds(random);
      markMoved(object);
      break;
    case kRay:
      dGeomRaySetLength(geom, a + b);
      break;
    default:
      break;
  }
}

// Own bodies, any there is, none, or any without a move: what was in reach stays there.
void Driver::giveBody(int object, std::size_t way, Random& random) {
  Object& o = objects_[object];
  if (o.kind >= kPlane) return;
  int body = kNone;
  if (way == 0 && bodies_.size() < kMostBodies) body = createBody(object);
  if (way != 2 && body == kNone && !bodies_.empty()) {
    body = static_cast<int>(random.below(bodies_.size()));
    if (!bodies_[body]) body = kNone;
  }
  dVector3 at;
  dGeomCopyPosition(o.geom, at);
  // dGeomSetBody (geom, another body) would leak an offset geom's own position.
  if (o.body != kNone && body != o.body) dGeomClearOffset(o.geom);
  dGeomSetBody(o.geom, body == kNone ? nullptr : bodies_[body]);
  if (way == 3 && body != kNone) dGeomSetOffsetWorldPosition(o.geom, at[0], at[1], at[2]);
  o.body = body;
}

// Of speeds ODE tells no space, and no program need: swept bounds find them.
void Driver::push(int object, std::size_t, Random& random) {
  if (const int body = objects_[object].body; body != kNone)
    dBodySetLinearVel(bodies_[body], real(random.between(-9, 9)), 0, 0);
}

// None, a place, an orientation.
void Driver::changeOffset(int object, std::size_t way, Random& random) {
  const Object& o = objects_[object];
  if (o.body == kNone) return;
  const dReal x = real(random.between(-1, 1)), y = real(random.between(-1, 1));
  dMatrix3 rotation;
  dRFromEulerAngles(rotation, x, -x, y);
  if (way == 0) dGeomClearOffset(o.geom);
  if (way == 1) dGeomSetOffsetPosition(o.geom, x, -x, y);
  if (way == 2) dGeomSetOffsetRotation(o.geom, rotation);
}

void Driver::changeBits(int object, std::size_t way, Random& random) {
  constexpr std::size_t count = 8 * sizeof(long);
  const unsigned long few = random.below(8), one = 1ul << random.below(count);
  const unsigned long ways[] = {~0ul, 0, few, few << (count - 24), one, ~one};
  const unsigned long bits = ways[way];
  if (random.chance(0.7)) dGeomSetCategoryBits(objects_[object].geom, bits);
  if (random.chance(0.7)) dGeomSetCollideBits(objects_[object].geom, bits);
}

void Driver::changeEnabled(int object, std::size_t way, Random& random) {
  const bool enable = way == 2 ? random.chance(0.5) : way != 0;
  (enable ? dGeomEnable : dGeomDisable)(objects_[object].geom);
}

// Asking for bounds takes the mark of bad bounds off a geom, not that of a moved one.
void Driver::lookAt(int object, std::size_t, Random&) {
  boundsOf(objects_[object].geom);
}

// User classes and meshes change without a word to anybody.
void Driver::changeUnasked(int object, std::size_t, Random& random) {
  if (objects_[object].kind == kMesh) changeTriangles(object, random.below(2));
  if (objects_[object].kind != kUser || !changes_users_unasked_) return;
  userBoxData(objects_[object].geom).bounds = randomBounds(random);
  userBoxData(objects_[object].geom).mood = static_cast<unsigned>(random.below(5));
}

void Driver::cleanSpace() {
  const int space = pickSpace();
  log("clean " + std::to_string(space));
  dSpaceClean(spaceOf(space));
  checkList(space);
}

void Driver::destroySpace() {
  const int space = pickSpace();
  const bool cleans_up = decisions_.chance(100);
  if (space == spaces_[0]) return;
  log("destroy space " + std::to_string(space));
  dSpaceSetCleanup(spaceOf(space), cleans_up);
  objects_[space].cleans_up = cleans_up;
  destroy(space);
}

// To where hardly anything should be; a few only, as they may all meet there.
void Driver::moveFar() {
  const int space = pickSpace();
  Random random = decisions_.random();
  const std::size_t count = 1 + decisions_.below(8);
  log("move " + std::to_string(count) + " of " + std::to_string(space) + " far away");
  for (std::size_t i = 0; i < count; ++i) {
    const int object = pickMember(space, random);
    if (object == kNone || objects_[object].kind >= kPlane) continue;
    const dReal* const at = dGeomGetPosition(objects_[object].geom);
    dReal to[3] = {at[0], at[1], at[2]};
    to[random.below(3)] = extremeNumber(random);
    if (random.chance(0.3)) to[random.below(3)] = extremeNumber(random);
    dGeomSetPosition(objects_[object].geom, to[0], to[1], to[2]);
    ++changes_;
  }
}

// Moves, puts to sleep or wakes some bodies.
void Driver::changeBodies() {
  Random random = decisions_.random();
  const std::size_t how = decisions_.below(4);
  const double part = decisions_.chance(128) ? 1 : 0.1;
  log("change bodies, way " + std::to_string(how));
  for (const dBodyID body : bodies_) {
    if (!body || !random.chance(part)) continue;
    ++changes_;
    if (how == 0) dBodyDisable(body);
    if (how == 1) dBodyEnable(body);
    if (how == 2) random.chance(0.5) ? dBodyDisable(body) : dBodyEnable(body);
    if (how == 3) {
      const dReal x = real(random.between(0, side()));
      const dReal y = real(random.between(0, side()));
      dBodySetPosition(body, x, y, real(random.between(0, side())));
    }
  }
  tellOfAll();
}

void Driver::destroyBodies() {
  Random random = decisions_.random();
  log("destroy bodies");
  for (int i = 0; i < 3 && !bodies_.empty(); ++i) {
    const int body = static_cast<int>(random.below(bodies_.size()));
    if (!bodies_[body]) continue;
    dBodyDestroy(bodies_[body]);
    bodies_[body] = nullptr;
    for (const int leaf : alive_) {
      if (objects_[leaf].body == body) objects_[leaf].body = kNone;
    }
    ++changes_;
  }
  tellOfAll();
}

// From one space to another; also what is in none.
void Driver::moveToOtherSpace() {
  const int from = pickSpace(), to = pickSpace();
  Random random = decisions_.random();
  log("move some of " + std::to_string(from) + " to " + std::to_string(to));
  for (const int object : pickSome(from, random)) {
    if (isInside(to, object)) continue;
    remove(object);
    add(object, to);
    ++changes_;
  }
  for (const int leaf : alive_) {
    if (objects_[leaf].parent == kNone && random.chance(0.1)) add(leaf, to);
  }
}

void Driver::changeSettings() {
  const int space = pickSpace();
  const std::size_t setting = decisions_.below(kSettings), value = decisions_.below(6);
  log("setting " + std::to_string(setting) + " of " + std::to_string(space) + ": " +
      std::to_string(value));
  change(space, setting, value);
}

void Driver::change(int space, std::size_t setting, std::size_t value) {
  ++changes_;
  const dSpaceID id = spaceOf(space);
  const int number = static_cast<int>(value);
  if (setting == 0) dSpaceSetSublevel(id, number % 3);
  if (!objects_[space].ours) return;
  const int methods[] = {dParallelSAPMethodAuto,       dParallelSAPMethodSweep,
                         dParallelSAPMethodBruteForce, dParallelSAPMethodAxisLists,
                         dParallelSAPMethodAuto,       dParallelSAPMethodSweep};
  constexpr dReal most = std::numeric_limits<dReal>::max();
  const dReal tolerances[] = {0, dReal(0.01), dReal(0.1), dReal(0.5), most, 2};
  // The oracle asks geoms for their bounds, which are the swept ones then.
  const dReal steps[] = {0, dReal(0.01), dReal(0.1), 1, 0, 100};
  if (setting == 1 && !configuration_) dParallelSAPSpaceSetMethod(id, methods[value]);
  if (setting == 2) dParallelSAPSpaceSetNumThreads(id, number);
  if (setting == 3 && !configuration_) dParallelSAPSpaceSetBackend(id, number % 3);
  if (setting == kSkipStatic) dParallelSAPSpaceSetSkipStatic(id, number % 2);
  if (setting == kSkipAsleep) dParallelSAPSpaceSetSkipAsleep(id, number % 2);
  if (setting == kNotified) dParallelSAPSpaceSetNotified(id, number % 2);
  if (setting == 7) dParallelSAPSpaceSetCullPlanes(id, number % 2);
  if (setting == 8) dParallelSAPSpaceSetTolerance(id, tolerances[value]);
  if (setting == kSweptBounds && sweeps_) dParallelSAPSpaceSetSweptBounds(id, steps[value]);
}

void Driver::stepWorld() {
  Random random = decisions_.random();
  const double speed = decisions_.chance(128) ? 1 : 1e3;
  log("step the world");
  stepBodies(0.5, speed, random);
}

// A part of the bodies is woken and pushed, of which spaces are told; most others are stopped. All
// cross the world, fall asleep and wake others by themselves, of which nobody need tell.
void Driver::stepBodies(double part, double speed, Random& random) {
  std::vector<bool> pushed(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (!bodies_[i]) continue;
    pushed[i] = random.chance(part);
    const dReal x = real(pushed[i] ? random.between(-speed, speed) : 0);
    if (pushed[i]) dBodyEnable(bodies_[i]);
    if (pushed[i] || random.chance(0.8)) dBodySetLinearVel(bodies_[i], x, -x / 2, -x);
  }
  for (const int leaf : alive_)
    if (const int body = objects_[leaf].body; body != kNone && pushed[body]) tell(leaf);
  dWorldSetQuickStepNumIterations(world_, 1);
  dWorldQuickStep(world_, dReal(0.01));
  ++changes_;
}

}  // namespace sap_test
