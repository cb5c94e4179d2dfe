// The driver's geoms, spaces and bodies: how they come, go and change places.
#include <cstdlib>
#include <thread>

#include "../support/mesh.h"
#include "driver.h"

namespace sap_test {
namespace {

// On the calling thread alone.
int vetoes(dGeomID self, dGeomID other, dReal[6]) {
  static const std::thread::id caller = std::this_thread::get_id();
  if (std::this_thread::get_id() != caller) std::abort();
  return (31 * number(self) + 17 * number(other) + userBoxData(self).mood) % 7 != 0;
}

// The same tetrahedron, here and out of the crowd.
const Mesh& trianglesAt(std::size_t place) {
  static const Mesh &here = *new Mesh(tetrahedron()), &above = *new Mesh(tetrahedron(0, 20));
  return place ? above : here;
}

}  // namespace

// ODE says nothing of it to anybody.
void Driver::changeTriangles(int object, std::size_t place) {
  dGeomTriMeshSetData(objects_[object].geom, trianglesAt(place).data());
  changed_meshes_.push_back(object);
}

// To stock spaces, which clean only what is in front of their lists.
void Driver::announceMeshes() {
  for (const int object : changed_meshes_) {
    const int space = objects_[object].parent;
    if (!objects_[object].geom || space == kNone) continue;
    objects_[space].ours ? markMoved(space) : addAgain(object);
  }
  changed_meshes_.clear();
}

dReal Driver::extremeNumber(Random& random) {
  constexpr dReal most = std::numeric_limits<dReal>::max();
  const dReal values[] = {0,
                          std::numeric_limits<dReal>::denorm_min(),
                          real(1e-30),
                          real(1e6),
                          real(1e9),
                          real(1e12),
                          real(1e30),
                          most / 2,
                          most,
                          std::numeric_limits<dReal>::infinity(),
                          std::numeric_limits<dReal>::quiet_NaN()};
  const dReal value = values[random.below(std::size(values))];
  return random.chance(0.5) ? value : -value;
}

dReal Driver::randomLength(Random& random) {
  if (random.chance(0.02)) return 0;
  if (random.chance(0.03)) return real(random.between(1, 10));
  return random.chance(0.3) ? 1 : real(random.between(0.1, 1.5));
}

Bounds Driver::randomBounds(Random& random) {
  const dReal a = randomLength(random) / 2, b = randomLength(random) / 2,
              c = randomLength(random) / 2;
  if (random.chance(0.03)) return {a, -a, -b, b, -c, c};
  Bounds bounds = {-a, a, -b, b, -c, c};
  if (random.chance(0.03)) bounds[random.below(6)] = extremeNumber(random);
  return bounds;
}

void Driver::add(int object, int space) {
  dSpaceAdd(spaceOf(space), objects_[object].geom);
  objects_[object].parent = space;
  if (!objects_[object].left_stock || objects_[space].ours) objects_[object].stay = ++additions_;
  objects_[space].members.push_back(object);
  // ODE's own spaces get into trouble with a clean geom in front of dirty ones.
  if (!objects_[space].ours) markMoved(object);
}

void Driver::leave(int object) {
  Object& o = objects_[object];
  if (o.parent == kNone) return;
  std::vector<int>& members = objects_[o.parent].members;
  members.erase(std::find(members.begin(), members.end(), object));
  o.left_stock = !objects_[o.parent].ours;
  o.left.emplace_back(++time_, o.parent);
  o.parent = kNone;
}

void Driver::remove(int object) {
  dSpaceRemove(spaceOf(objects_[object].parent), objects_[object].geom);
  leave(object);
}

void Driver::addAgain(int object) {
  const int space = objects_[object].parent;
  remove(object);
  add(object, space);
}

void Driver::markMoved(int object) {
  const Object& o = objects_[object];
  if (o.kind == kSpace) {
    dGeomDestroy(dCreateSphere(spaceOf(object), 1));
  } else if (o.kind == kPlane) {
    dVector4 plane;
    dGeomPlaneGetParams(o.geom, plane);
    dGeomPlaneSetParams(o.geom, plane[0], plane[1], plane[2], plane[3]);
  } else if (o.body != kNone) {
    dVector3 position;
    dBodyCopyPosition(bodies_[o.body], position);
    dBodySetPosition(bodies_[o.body], position[0], position[1], position[2]);
  } else {
    dVector3 position;
    dGeomCopyPosition(o.geom, position);
    dGeomSetPosition(o.geom, position[0], position[1], position[2]);
  }
}

void Driver::forget(int object) {
  leave(object);
  Object& o = objects_[object];
  o.geom = nullptr;
  std::vector<int>& list = o.kind == kSpace ? spaces_ : alive_;
  list.erase(std::find(list.begin(), list.end(), object));
  const std::vector<int> members = o.members;
  for (const int member : members) o.cleans_up ? forget(member) : leave(member);
}

void Driver::destroy(int object) {
  const dGeomID geom = objects_[object].geom;
  forget(object);
  dGeomDestroy(geom);
}

int Driver::createLeaf(Kind kind, Random& random) {
  const dReal a = randomLength(random), b = randomLength(random), c = randomLength(random);
  dGeomID geom = nullptr;
  switch (kind) {
    case kBox:
      geom = dCreateBox(nullptr, a, b, c);
      break;
    case kSphere:
      geom = dCreateSphere(nullptr, a / 2);
      break;
    case kCapsule:
      geom = dCreateCapsule(nullptr, a / 2, b);
      break;
    case kCylinder:
      geom = dCreateCylinder(nullptr, a / 2, b);
      break;
    case kUser:
      geom = createUserBox(nullptr, randomBounds(random), true,
                           random.chance(0.5) && makes_tests_ ? vetoes : nullptr);
      break;
    case kMesh:
      geom = trianglesAt(random.below(2)).create(nullptr);
      break;
    case kRay:
      geom = dCreateRay(nullptr, a + b);
      break;
    default: {
      dReal normal[3] = {0, 0, 0};
      normal[random.below(3)] = random.chance(0.5) ? 1 : -1;
      if (random.chance(0.5)) normal[random.below(3)] += dReal(0.5);
      geom =
          dCreatePlane(nullptr, normal[0], normal[1], normal[2], real(random.between(-2, side())));
    }
  }
  const int id = static_cast<int>(objects_.size());
  setNumber(geom, static_cast<std::size_t>(id));
  objects_.push_back({kind, geom, kNone, kNone, false, true, {}, 0, false, {}});
  alive_.push_back(id);
  return id;
}

void Driver::place(int object, std::size_t how, Random& random) {
  const Object& o = objects_[object];
  if (o.kind == kSpace) return;
  const double reach = side();
  if (o.kind == kPlane) {
    dVector4 plane;
    dGeomPlaneGetParams(o.geom, plane);
    dGeomPlaneSetParams(o.geom, plane[0], plane[1], plane[2], real(random.between(-2, reach)));
    return;
  }
  double at[3];
  for (double& coordinate : at) coordinate = random.between(0, reach);
  if (how == 1) {
    for (double& coordinate : at) coordinate = std::floor(coordinate);
  } else if (how == 2) {  // a little way, where it can be followed
    const dReal* const old = dGeomGetPosition(o.geom);
    for (int axis = 0; axis < 3; ++axis) {
      const double before = static_cast<double>(old[axis]);
      if (std::fabs(before) < 10 * reach + 100) at[axis] = before + random.between(-0.05, 0.05);
    }
  } else if (how == 3) {
    for (double& coordinate : at) coordinate += 1e6;
  }
  dGeomSetPosition(o.geom, real(at[0]), real(at[1]), real(at[2]));
}

int Driver::createBody(int at_object) {
  const dBodyID body = dBodyCreate(world_);
  const dReal* const at = dGeomGetPosition(objects_[at_object].geom);
  dBodySetPosition(body, at[0], at[1], at[2]);
  // A body without a joint never falls asleep by itself.
  const dBodyID other = bodies_.size() % 2 ? bodies_.back() : nullptr;
  dJointAttach(dJointCreateLMotor(world_, nullptr), body, other);
  bodies_.push_back(body);
  return static_cast<int>(bodies_.size()) - 1;
}

// A crowd of geoms at once: the sizes at which a space changes its ways.
void Driver::populate() {
  const std::size_t counts[] = {1, 2, 10, 38, 41, 90, 200, 450, 701, 1100, 1700, 3000};
  const std::size_t count = counts[decisions_.below(std::size(counts))];
  const int space = pickSpace();
  Random random = decisions_.random();
  const bool boxes_only = decisions_.chance(100);
  if (alive_.size() + count > most_geoms_) return;
  log("populate space " + std::to_string(space) + " with " + std::to_string(count));
  for (std::size_t i = 0; i < count; ++i) {
    Kind kind = boxes_only ? kBox : static_cast<Kind>(random.below(kLeafKinds));
    if (kind == kPlane && random.chance(0.9)) kind = kBox;
    const int leaf = createLeaf(kind, random);
    if (random.chance(0.5)) place(leaf, 0, random);  // before or after it is added
    add(leaf, space);
    place(leaf, 0, random);
  }
}

void Driver::createOne() {
  const std::size_t kind = decisions_.below(kLeafKinds);
  const bool added = decisions_.chance(230);
  const int space = pickSpace();
  Random random = decisions_.random();
  if (alive_.size() >= most_geoms_) return;
  const int leaf = createLeaf(static_cast<Kind>(kind), random);
  place(leaf, random.below(2), random);
  log("create " + std::to_string(leaf) + (added ? " in " + std::to_string(space) : ""));
  if (added) add(leaf, space);
}

int Driver::createSpace(bool ours, int parent) {
  const dSpaceID space = ours ? dParallelSAPSpaceCreate(nullptr) : dSimpleSpaceCreate(nullptr);
  if (ours && configuration_) configure(space, *configuration_);
  const int id = static_cast<int>(objects_.size());
  log("create space " + std::to_string(id) + (ours ? " (ours)" : " (dSimpleSpace)") +
      (parent == kNone ? "" : " in " + std::to_string(parent)));
  setNumber(asGeom(space), static_cast<std::size_t>(id));
  objects_.push_back({kSpace, asGeom(space), kNone, kNone, ours, true, {}, 0, false, {}});
  spaces_.push_back(id);
  if (parent != kNone) add(id, parent);
  return id;
}

void Driver::createSpace() {
  const bool ours = spaces_.empty() || decisions_.chance(190);
  const bool nested = !spaces_.empty() && decisions_.chance(160);
  if (spaces_.size() >= kMostSpaces) return;
  const int id = createSpace(ours, nested ? pickSpace() : kNone);
  for (const std::size_t option : {kSkipStatic, kSkipAsleep, kNotified, kSweptBounds})
    if (decisions_.chance(80)) change(id, option, 1);
  // A few geoms near each other, on bodies that move.
  Random random = decisions_.random();
  const double x = random.between(0, side()), y = random.between(0, side());
  for (std::size_t few = random.below(8); few > 0 && alive_.size() < most_geoms_; --few) {
    const int leaf = createLeaf(random.chance(0.5) ? kBox : kSphere, random);
    const auto near = [&](double place) { return real(place + random.between(-1, 1)); };
    dGeomSetPosition(objects_[leaf].geom, near(x), near(y), near(x));
    add(leaf, id);
    giveBody(leaf, 0, random);
    push(leaf, 0, random);
  }
}

}  // namespace sap_test
