#include "twin_worlds.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "oracle.h"
#include "user_box.h"

namespace sap_test {
namespace {

// Every object is born into a region in which it overlaps a few others.
constexpr double kSide = 6;
// The region lies around x = y = 0, but clear of z = 0: dHashSpace (0.16.2) misses pairs of boxes
// that reach from negative to positive z in the cells next to the z axis, because it finds those
// cells under other addresses from below than from above.
constexpr double kLowest = 8;

// Depends on numbers only, so it says the same in every world; not symmetric on purpose.
int rejectsSome(dGeomID self, dGeomID other, dReal[6]) {
  return (31 * number(self) + 17 * number(other)) % 7 != 0;
}

dGeomID asGeom(dSpaceID space) {
  return reinterpret_cast<dGeomID>(space);
}

bool isEmptySpace(dGeomID geom) {
  return dGeomIsSpace(geom) && dSpaceGetNumGeoms(reinterpret_cast<dSpaceID>(geom)) == 0;
}

struct Contacts {
  Pairs pairs;
  bool without_empty_spaces;
};

void recordContact(void* data, dGeomID a, dGeomID b) {
  Contacts& contacts = *static_cast<Contacts*>(data);
  if (contacts.without_empty_spaces && (isEmptySpace(a) || isEmptySpace(b))) return;
  contacts.pairs.emplace_back(number(a), number(b));
}

// Empty sub-spaces are the one thing in which our space owes other pairs than ODE's.
Pairs collideWithoutEmptySpaces(dSpaceID space) {
  Contacts contacts{{}, true};
  dSpaceCollide(space, &contacts, recordContact);
  return contacts.pairs;
}

Pairs collide2WithoutEmptySpaces(dGeomID a, dGeomID b) {
  Contacts contacts{{}, true};
  dSpaceCollide2(a, b, &contacts, recordContact);
  return contacts.pairs;
}

// As ODE's manual has it: a space in a pair is taken apart. The order of arguments is settled by
// number, since dSpaceCollide2 treats its two arguments differently and the spaces of the three
// worlds report theirs in different orders.
void recordLeaves(void* pairs, dGeomID a, dGeomID b) {
  if (number(a) > number(b)) std::swap(a, b);
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) {
    dSpaceCollide2(a, b, pairs, recordLeaves);
  } else {
    record(pairs, a, b);
  }
}

}  // namespace

TwinWorlds::TwinWorlds(std::uint64_t seed, const Configuration& configuration, int geoms)
    : random_(seed), configuration_(configuration) {
  for (dWorldID& world : dynamics_) world = dWorldCreate();
  objects_.reserve(1000);
  const int main_space = createSpace();
  objects_[main_space].ours = true;
  createSpace();
  for (int i = 0; i < geoms; ++i) {
    const int leaf = createLeaf();
    if (objects_[leaf].parent == kNone) add(leaf, main_space);
  }
}

TwinWorlds::~TwinWorlds() {
  // Roots first: the order that leaves most to the spaces. Some of these let go of their geoms.
  for (bool any = true; any;) {
    any = false;
    for (int i = 0; i < static_cast<int>(objects_.size()); ++i) {
      if (!objects_[i].alive || objects_[i].parent != kNone) continue;
      destroy(i);
      any = true;
    }
  }
  for (dWorldID world : dynamics_) dWorldDestroy(world);
}

void TwinWorlds::log(const std::string& call) {
  history_.push_back(std::to_string(++calls_) + ": " + call);
  if (history_.size() > 40) history_.pop_front();
}

std::string TwinWorlds::history() const {
  std::string text = "\n";
  for (const std::string& call : history_) text += call + "\n";
  return text;
}

dReal TwinWorlds::coordinate() {
  // Some on a lattice, so that faces touch.
  const double value = random_.between(-kSide / 2, kSide / 2);
  return static_cast<dReal>(random_.chance(0.3) ? std::floor(value) : value);
}

dReal TwinWorlds::height() {
  return coordinate() + static_cast<dReal>(kLowest + kSide / 2);
}

dReal TwinWorlds::size() {
  if (random_.chance(0.05)) return 0;
  if (random_.chance(0.1)) return static_cast<dReal>(random_.between(1, 2 * kSide));
  return random_.chance(0.3) ? 1 : static_cast<dReal>(random_.between(0.1, 1.5));
}

int TwinWorlds::pick(bool (*wanted)(const Object&)) {
  std::vector<int> found;
  for (int i = 0; i < static_cast<int>(objects_.size()); ++i) {
    if (objects_[i].alive && wanted(objects_[i])) found.push_back(i);
  }
  return found.empty() ? kNone : found[random_.below(found.size())];
}

int TwinWorlds::pickBody() {
  std::vector<int> found;
  for (int i = 0; i < static_cast<int>(bodies_.size()); ++i) {
    if (bodies_[i].alive) found.push_back(i);
  }
  return found.empty() ? kNone : found[random_.below(found.size())];
}

bool TwinWorlds::isInside(int object, int space) const {
  for (; object != kNone; object = objects_[object].parent) {
    if (object == space) return true;
  }
  return false;
}

dSpaceID TwinWorlds::space(int object, int world) const {
  return reinterpret_cast<dSpaceID>(objects_[object].in[world]);
}

bool TwinWorlds::isStock(int space, int world) const {
  return world != kOurs || !objects_[space].ours;
}

int TwinWorlds::createLeaf() {
  Object object;
  object.kind = static_cast<Kind>(random_.below(kLeafKinds));
  if (object.kind == kPlane && random_.chance(0.8)) object.kind = kBox;
  const int id = static_cast<int>(objects_.size());
  const dReal a = size(), b = size(), c = size();
  const dReal x = coordinate(), y = coordinate(), z = height();
  const std::size_t direction = random_.below(4);
  object.plane = {direction == 0 ? dReal(1) : 0, direction == 1 ? dReal(-1) : 0,
                  direction >= 2 ? dReal(1) : 0, direction >= 2 ? z : x};
  if (direction == 3) object.plane[0] = dReal(0.5);
  log("create leaf " + std::to_string(id) + " of kind " + std::to_string(object.kind));

  for (int world = 0; world < kWorlds; ++world) {
    dGeomID& geom = object.in[world];
    switch (object.kind) {
      case kSphere:
        geom = dCreateSphere(nullptr, a / 2);
        break;
      case kBox:
        geom = dCreateBox(nullptr, a, b, c);
        break;
      case kCapsule:
        geom = dCreateCapsule(nullptr, a / 2, b);
        break;
      case kCylinder:
        geom = dCreateCylinder(nullptr, a / 2, b);
        break;
      case kRay:
        geom = dCreateRay(nullptr, a + b);
        break;
      case kUser:
        geom = createUserBox(nullptr, {-a / 2, a / 2, -b / 2, b / 2, -c / 2, c / 2}, true,
                             rejectsSome);
        break;
      default:
        geom = dCreatePlane(nullptr, object.plane[0], object.plane[1], object.plane[2],
                            object.plane[3]);
    }
    if (object.kind != kPlane) dGeomSetPosition(geom, x, y, z);
    setNumber(geom, static_cast<std::size_t>(id));
  }
  objects_.push_back(object);
  if (random_.chance(0.9)) add(id, pick([](const Object& o) { return o.kind == kSpace; }));
  return id;
}

int TwinWorlds::createSpace() {
  Object object;
  object.kind = kSpace;
  object.ours = random_.chance(0.6);
  const int id = static_cast<int>(objects_.size());
  if (id == 0) object.ours = true;
  log("create space " + std::to_string(id) + (object.ours ? " (ours)" : " (stock)"));
  for (int world = 0; world < kWorlds; ++world) {
    dSpaceID made;
    if (world == kOurs && object.ours) {
      made = dParallelSAPSpaceCreate(nullptr);
      configure(made, configuration_);
    } else {
      made = world == kHash ? dHashSpaceCreate(nullptr) : dSimpleSpaceCreate(nullptr);
    }
    object.in[world] = asGeom(made);
    setNumber(object.in[world], static_cast<std::size_t>(id));
  }
  objects_.push_back(object);
  return id;
}

void TwinWorlds::createSpaceInside() {
  int alive = 0;
  for (const Object& object : objects_) alive += object.alive && object.kind == kSpace;
  if (alive >= 8) return;
  const int parent = pick([](const Object& o) { return o.kind == kSpace; });
  const int made = createSpace();
  if (parent != kNone && random_.chance(0.8)) add(made, parent);
}

int TwinWorlds::createBody() {
  Body body;
  const int id = static_cast<int>(bodies_.size());
  const dReal x = coordinate(), y = coordinate(), z = height();
  log("create body " + std::to_string(id));
  for (int world = 0; world < kWorlds; ++world) {
    body.in[world] = dBodyCreate(dynamics_[world]);
    dBodySetPosition(body.in[world], x, y, z);
  }
  bodies_.push_back(body);
  return id;
}

// ODE's own spaces get into trouble with a clean geom that is added in front of dirty ones. Ours
// must not, so only theirs are helped: the geom is marked as moved without being moved.
void TwinWorlds::makeDirty(int object, int world) {
  const Object& o = objects_[object];
  const dGeomID geom = o.in[world];
  if (o.kind == kSpace) {
    const dGeomID passing = dCreateSphere(space(object, world), 1);
    dGeomDestroy(passing);
  } else if (o.kind == kPlane) {
    dGeomPlaneSetParams(geom, o.plane[0], o.plane[1], o.plane[2], o.plane[3]);
  } else if (o.body != kNone) {
    const dBodyID body = bodies_[o.body].in[world];
    dVector3 position;
    dBodyCopyPosition(body, position);
    dBodySetPosition(body, position[0], position[1], position[2]);
  } else {
    dVector3 position;
    dGeomCopyPosition(geom, position);
    dGeomSetPosition(geom, position[0], position[1], position[2]);
  }
}

void TwinWorlds::add(int object, int space_object) {
  log("add " + std::to_string(object) + " to " + std::to_string(space_object));
  for (int world = 0; world < kWorlds; ++world) {
    dSpaceAdd(space(space_object, world), objects_[object].in[world]);
    if (isStock(space_object, world)) makeDirty(object, world);
  }
  objects_[object].parent = space_object;
  objects_[space_object].members.push_back(object);
}

void TwinWorlds::remove(int object) {
  const int parent = objects_[object].parent;
  log("remove " + std::to_string(object) + " from " + std::to_string(parent));
  for (int world = 0; world < kWorlds; ++world) {
    dSpaceRemove(space(parent, world), objects_[object].in[world]);
  }
  std::vector<int>& members = objects_[parent].members;
  members.erase(std::find(members.begin(), members.end(), object));
  objects_[object].parent = kNone;
}

void TwinWorlds::forget(int object) {
  Object& o = objects_[object];
  o.alive = false;
  for (const int member : o.members) {
    objects_[member].parent = kNone;
    if (o.cleans_up) forget(member);
  }
  o.members.clear();
}

void TwinWorlds::destroy(int object) {
  log("destroy " + std::to_string(object));
  const int parent = objects_[object].parent;
  if (parent != kNone) {
    std::vector<int>& members = objects_[parent].members;
    members.erase(std::find(members.begin(), members.end(), object));
  }
  for (const dGeomID geom : objects_[object].in) dGeomDestroy(geom);
  forget(object);
}

void TwinWorlds::edit() {
  const auto any = [](const Object&) { return true; };
  switch (random_.below(20)) {
    case 0:
      createLeaf();
      break;
    case 1: {
      const int leaf = pick([](const Object& o) { return o.kind != kSpace; });
      if (leaf != kNone) destroy(leaf);
      createLeaf();
      break;
    }
    case 2: {
      const int object = pick([](const Object& o) { return o.parent != kNone; });
      if (object != kNone) remove(object);
      break;
    }
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
    case 9: {
      const int object = pick(any);
      const bool enable = random_.chance(0.6);
      log((enable ? "enable " : "disable ") + std::to_string(object));
      for (const dGeomID geom : objects_[object].in) {
        if (enable) {
          dGeomEnable(geom);
        } else {
          dGeomDisable(geom);
        }
      }
      break;
    }
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

std::string TwinWorlds::check() {
  // What is found in one space must not depend on which other was looked at before.
  std::vector<int> spaces;
  for (int i = 0; i < static_cast<int>(objects_.size()); ++i) {
    if (objects_[i].alive && objects_[i].kind == kSpace) spaces.push_back(i);
  }
  for (std::size_t i = spaces.size(); i > 1; --i) {
    std::swap(spaces[i - 1], spaces[random_.below(i)]);
  }
  for (const int space_object : spaces) {
    std::string problem;
    if (random_.chance(0.5)) problem = checkEnumeration(space_object);
    if (problem.empty()) problem = checkPairs(space_object);
    if (problem.empty() && random_.chance(0.3)) problem = checkPairs(space_object);
    if (problem.empty()) problem = checkEnumeration(space_object);
    if (problem.empty()) problem = checkAllTheWayDown(space_object);
    if (!problem.empty()) return "space " + std::to_string(space_object) + ": " + problem;
  }
  return checkCollide2();
}

std::string TwinWorlds::checkEnumeration(int space_object) {
  const dSpaceID ours = space(space_object, kOurs);
  const std::vector<int>& members = objects_[space_object].members;
  if (dSpaceGetNumGeoms(ours) != static_cast<int>(members.size())) {
    return "dSpaceGetNumGeoms: got " + std::to_string(dSpaceGetNumGeoms(ours)) + ", expected " +
           std::to_string(members.size());
  }
  std::vector<int> listed;
  for (int i = 0; i < dSpaceGetNumGeoms(ours); ++i) {
    const dGeomID geom = dSpaceGetGeom(ours, i);
    if (!geom) return "dSpaceGetGeom (" + std::to_string(i) + ") is 0";
    listed.push_back(static_cast<int>(number(geom)));
  }
  std::sort(listed.begin(), listed.end());
  std::vector<int> expected = members;
  std::sort(expected.begin(), expected.end());
  if (listed != expected) return "dSpaceGetGeom does not give every geom exactly once";
  for (int i = 0; i < static_cast<int>(objects_.size()); ++i) {
    const Object& o = objects_[i];
    if (!o.alive) continue;
    if ((dSpaceQuery(ours, o.in[kOurs]) != 0) != (o.parent == space_object)) {
      return "dSpaceQuery is wrong about " + std::to_string(i);
    }
  }
  return "";
}

std::string TwinWorlds::checkPairs(int space_object) {
  std::vector<dGeomID> twins;
  for (const int member : objects_[space_object].members) {
    twins.push_back(objects_[member].in[kSimple]);
  }
  const auto where = [](const char* what, const std::string& problem) {
    return problem.empty() ? problem : std::string(what) + ": " + problem;
  };
  std::string problem;
  if (isStock(space_object, kOurs)) {
    problem = where("a stock space, our world against the simple one",
                    difference(asSet(collide(space(space_object, kOurs))),
                               asSet(collide(space(space_object, kSimple)))));
  } else {
    // Ours first: the oracle asks the twins for their bounds, never our geoms.
    const Pairs got = collide(space(space_object, kOurs));
    const Pairs expected = expectedPairs(twins);
    problem = where("ours against the oracle", difference(got, expected));
    for (const World world : {kSimple, kHash}) {
      if (!problem.empty()) break;
      problem = where(
          world == kSimple ? "ours against dSimpleSpace" : "ours against dHashSpace",
          difference(asSet(got), asSet(collideWithoutEmptySpaces(space(space_object, world)))));
    }
  }
  return problem;
}

std::string TwinWorlds::checkAllTheWayDown(int space_object) {
  std::array<Pairs, kWorlds> leaves;
  for (int world = 0; world < kWorlds; ++world) {
    dSpaceCollide(space(space_object, world), &leaves[world], recordLeaves);
  }
  std::string problem = difference(asSet(leaves[kOurs]), asSet(leaves[kSimple]));
  if (problem.empty()) problem = difference(asSet(leaves[kOurs]), asSet(leaves[kHash]));
  return problem.empty() ? problem : "all sub-spaces taken apart: " + problem;
}

std::string TwinWorlds::checkCollide2() {
  for (int i = 0; i < 8; ++i) {
    int first = pick([](const Object&) { return true; });
    int second = pick([](const Object& o) { return o.kind == kSpace; });
    if (random_.chance(0.1)) first = second;
    if (random_.chance(0.5)) std::swap(first, second);
    const auto found = [&](int world) {
      return collide2WithoutEmptySpaces(objects_[first].in[world], objects_[second].in[world]);
    };
    const Pairs got = found(kOurs), expected = found(kSimple);
    // A space with itself is dSpaceCollide, in which only ours fixes the arguments.
    const std::string problem = first == second ? difference(asSet(got), asSet(expected))
                                                : difference(sorted(got), sorted(expected));
    if (!problem.empty()) {
      return "dSpaceCollide2 (" + std::to_string(first) + ", " + std::to_string(second) +
             "): " + problem;
    }
  }
  return "";
}

}  // namespace sap_test
