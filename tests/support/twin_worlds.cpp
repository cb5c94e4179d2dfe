#include "twin_worlds.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>

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

dGeomID TwinWorlds::makeLeaf(const Object& object, dReal a, dReal b, dReal c) {
  const std::array<dReal, 4>& plane = object.plane;
  switch (object.kind) {
    case kSphere:
      return dCreateSphere(nullptr, a / 2);
    case kBox:
      return dCreateBox(nullptr, a, b, c);
    case kCapsule:
      return dCreateCapsule(nullptr, a / 2, b);
    case kCylinder:
      return dCreateCylinder(nullptr, a / 2, b);
    case kRay:
      return dCreateRay(nullptr, a + b);
    case kUser:
      return createUserBox(nullptr, {-a / 2, a / 2, -b / 2, b / 2, -c / 2, c / 2}, true,
                           rejectsSome);
    default:
      return dCreatePlane(nullptr, plane[0], plane[1], plane[2], plane[3]);
  }
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

  for (dGeomID& geom : object.in) {
    geom = makeLeaf(object, a, b, c);
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

}  // namespace sap_test
