#include "contact_scene.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "bounds.h"
#include "mesh.h"
#include "random.h"
#include "scenes.h"

namespace sap_test {

namespace {

constexpr int kNumberBits = 0xffff;
constexpr double kTurn = 6.283185307179586;

std::atomic<std::size_t> calls_elsewhere{0};
std::atomic<std::size_t> calls{0};
std::thread::id this_thread = std::this_thread::get_id();

void noteUserCode() {
  ++calls;
  if (std::this_thread::get_id() != this_thread) ++calls_elsewhere;
}

int watchTriangle(dGeomID, dGeomID, int triangle) {
  noteUserCode();
  return triangle % 5 != 0;
}

int mergeTriangles(dGeomID, int first, int second) {
  noteUserCode();
  return std::min(first, second);
}

// A sphere of radius 0.6, which knows spheres only by their centres and radii and boxes by theirs.
int collideUserSphere(dGeomID o1, dGeomID o2, int flags, dContactGeom* contact, int) {
  noteUserCode();
  if ((flags & kNumberBits) < 1) return 0;
  const dReal* const p = dGeomGetPosition(o1);
  const dReal* const q = dGeomGetPosition(o2);
  double distance = 0;
  for (int i = 0; i < 3; ++i) distance += (p[i] - q[i]) * (p[i] - q[i]);
  distance = std::sqrt(distance);
  if (distance > 1.2) return 0;
  for (int i = 0; i < 3; ++i) {
    contact->pos[i] = (p[i] + q[i]) / 2;
    contact->normal[i] = real(distance > 0 ? (p[i] - q[i]) / distance : i == 0);
  }
  contact->depth = real(1.2 - distance);
  contact->g1 = o1;
  contact->g2 = o2;
  contact->side1 = contact->side2 = -1;
  return 1;
}

// A hundred hits in no order, beyond each other by a hundredth.
int collideUserRay(dGeomID user, dGeomID ray, int flags, dContactGeom* contacts, int skip) {
  noteUserCode();
  dVector3 from, along;
  dGeomRayGet(ray, from, along);
  const int count = std::min(100, flags & kNumberBits);
  for (int i = 0; i < count; ++i) {
    auto& contact = *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) + i * skip);
    contact.depth = real(0.5 + 0.01 * ((i * 37 + 11) % 100));
    for (int axis = 0; axis < 3; ++axis) {
      contact.pos[axis] = from[axis] + contact.depth * along[axis];
      contact.normal[axis] = -along[axis];
    }
    contact.g1 = user;
    contact.g2 = ray;
    contact.side1 = contact.side2 = i;
  }
  return count;
}

dColliderFn* userCollider(int other) {
  if (other == dRayClass) return &collideUserRay;
  return other == dSphereClass || other == dBoxClass || other >= dFirstUserClass
             ? &collideUserSphere
             : nullptr;
}

void userBounds(dGeomID geom, dReal bounds[6]) {
  const dReal* const p = dGeomGetPosition(geom);
  for (int i = 0; i < 3; ++i) {
    bounds[2 * i] = p[i] - real(0.6);
    bounds[2 * i + 1] = p[i] + real(0.6);
  }
}

int userClass() {
  static const int number = [] {
    dGeomClass description = {};
    description.collider = userCollider;
    description.aabb = userBounds;
    return dCreateGeomClass(&description);
  }();
  return number;
}

// Face angles, which the collider of convexes with meshes wants. Forks of older versions of ODE
// have neither.
template <class Data>
auto buildFaceAngles(Data data, std::nullptr_t none)
    -> decltype(dGeomTriMeshDataPreprocess2(data, 0, none)) {
  constexpr unsigned build_face_angles = 1U << 1;  // dTRIDATAPREPROCESS_BUILD_FACE_ANGLES
  return dGeomTriMeshDataPreprocess2(data, build_face_angles, none);
}
[[maybe_unused]] void buildFaceAngles(...) {}

Mesh* torus = nullptr;

dGeomID createTorus() {
  constexpr int around = 12, across = 8;
  std::vector<float> vertices;
  std::vector<dTriIndex> triangles;
  for (int i = 0; i < around && !torus; ++i)
    for (int j = 0; j < across; ++j) {
      const double u = kTurn * i / around, v = kTurn * j / across,
                   radius = 0.45 + 0.2 * std::cos(v);
      for (const double x : {radius * std::cos(u), radius * std::sin(u), 0.2 * std::sin(v)})
        vertices.push_back(static_cast<float>(x));
      for (const auto& [du, dv] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}})
        triangles.push_back(static_cast<dTriIndex>((i + du) % around * across + (j + dv) % across));
    }
  if (!torus) {
    torus = new Mesh(vertices, triangles);
    buildFaceAngles(torus->data(), nullptr);
  }
  return torus->create(nullptr);
}

constexpr int kSamples = 9;

dReal heightOf(void*, int x, int z) {
  noteUserCode();
  return real(0.4 * std::sin(1.7 * (x + z * kSamples)));
}

using Heights = std::map<Kind, dHeightfieldDataID>;

// Of this scene alone.
dGeomID createField(Heights& heights, Kind kind) {
  static float floats[kSamples * kSamples];
  unsigned char bytes[kSamples * kSamples];
  dHeightfieldDataID& data = heights[kind];
  if (!data) {
    for (int i = 0; i < kSamples * kSamples; ++i) {
      floats[i] = static_cast<float>(0.4 * std::sin(1.7 * i));
      bytes[i] = static_cast<unsigned char>(7 * i % 11);
    }
    data = dGeomHeightfieldDataCreate();
    constexpr int n = kSamples;
    if (kind == Kind::Heightfield)
      dGeomHeightfieldDataBuildSingle(data, floats, 0, 4, 4, n, n, 1, 0, 1, 0);
    else if (kind == Kind::FixedHeightfield)
      dGeomHeightfieldDataBuildByte(data, bytes, 1, 4, 4, n, n, real(0.1), 0, 1, 1);
    else
      dGeomHeightfieldDataBuildCallback(data, nullptr, heightOf, 4, 4, n, n, 1, 0, 1, 0);
  }
  return dCreateHeightfield(nullptr, data, kind != Kind::FixedHeightfield);
}

// As in other scenes.
dGeomID createShape(const std::string& name) {
  for (const Shape& shape : shapes())
    if (shape.name == name) return shape.create(nullptr);
  throw std::logic_error(name + " is no shape");
}

dGeomID createBox(Heights&) {
  return dCreateBox(nullptr, 1, real(0.8), real(1.1));
}

// In the order of the kinds.
dGeomID (*const kKinds[])(Heights& heights) = {
    [](Heights&) { return dCreateSphere(nullptr, real(0.6)); },
    createBox,
    [](Heights&) { return dCreateCapsule(nullptr, real(0.3), real(0.8)); },
    [](Heights&) { return dCreateCylinder(nullptr, real(0.4), 1); },
    [](Heights&) { return createShape("convex"); },
    [](Heights&) { return createTorus(); },
    [](Heights&) {
      const dGeomID geom = createTorus();
      dGeomTriMeshSetCallback(geom, watchTriangle);
      return geom;
    },
    [](Heights&) {
      const dGeomID geom = createTorus();
      dGeomTriMeshSetTriMergeCallback(geom, mergeTriangles);
      return geom;
    },
    [](Heights&) {
      const dGeomID geom = createTorus();
      for (const int other : {dSphereClass, dBoxClass, dCapsuleClass})
        dGeomTriMeshEnableTC(geom, other, 1);
      return geom;
    },
    [](Heights&) { return dCreateRay(nullptr, 2); },
    [](Heights&) { return createShape("geom transform"); },
    [](Heights&) { return dCreateGeom(userClass()); },
    createBox,
    [](Heights& all) { return createField(all, Kind::Heightfield); },
    [](Heights& all) { return createField(all, Kind::FixedHeightfield); },
    [](Heights& all) { return createField(all, Kind::CalledHeightfield); },
    [](Heights&) { return dCreatePlane(nullptr, 0, 0, 1, 0); }};

// Without the padding that dCollide leaves as it was.
bool sameBits(const Contact& a, const Contact& b) {
  return a.o1 == b.o1 && a.o2 == b.o2 && a.g1 == b.g1 && a.g2 == b.g2 && a.side1 == b.side1 &&
         a.side2 == b.side2 && std::memcmp(a.pos, b.pos, 3 * sizeof(dReal)) == 0 &&
         std::memcmp(a.normal, b.normal, 3 * sizeof(dReal)) == 0 &&
         std::memcmp(&a.depth, &b.depth, sizeof a.depth) == 0;
}

}  // namespace

void recordContacts(void* contacts, dGeomID o1, dGeomID o2, const dContactGeom* found, int count) {
  for (int i = 0; i < count; ++i) static_cast<Contacts*>(contacts)->push_back({found[i], o1, o2});
}

void SerialLoop::collide(void* loop, dGeomID o1, dGeomID o2) {
  SerialLoop& self = *static_cast<SerialLoop*>(loop);
  if (dGeomIsSpace(o1) || dGeomIsSpace(o2)) {
    dSpaceCollide2(o1, o2, loop, collide);
    for (const dGeomID geom : {o1, o2})
      if (self.inside && dGeomIsSpace(geom))
        dSpaceCollide(reinterpret_cast<dSpaceID>(geom), loop, collide);
    return;
  }
  const int flags = self.flags_of ? self.flags_of(self.data, o1, o2) : self.flags;
  if (!(flags & kNumberBits)) return;
  dContactGeom blank = {};
  blank.side1 = blank.side2 =
      -1;  // as the collider of two convexes leaves them in an ODE without libccd
  std::vector<dContactGeom> found(static_cast<std::size_t>(flags & kNumberBits), blank);
  int count =
      dCollide(o1, o2, flags & ~dParallelSAPOnCallingThread, found.data(), sizeof(dContactGeom));
  if (count && self.reduce) count = self.reduce(self.data, o1, o2, found.data(), count);
  recordContacts(&self.contacts, o1, o2, found.data(), count);
}

Contacts serialContacts(dSpaceID space, SerialLoop loop) {
  dSpaceCollide(space, &loop, SerialLoop::collide);
  return loop.contacts;
}

Contacts parallelContacts(dSpaceID space, int flags, dParallelSAPContactCallbacks more) {
  Contacts contacts;
  more.contacts = recordContacts;
  dParallelSAPSpaceCollideContacts(space, &contacts, flags, &more);
  return contacts;
}

std::string difference(const Contacts& got, const Contacts& expected) {
  for (std::size_t i = 0; i < std::min(got.size(), expected.size()); ++i)
    if (!sameBits(got[i], expected[i]))
      return "contact " + std::to_string(i) + " of " + std::to_string(expected.size()) +
             " differs: classes " + std::to_string(dGeomGetClass(got[i].o1)) + " and " +
             std::to_string(dGeomGetClass(got[i].o2)) + ", expected " +
             std::to_string(dGeomGetClass(expected[i].o1)) + " and " +
             std::to_string(dGeomGetClass(expected[i].o2));
  if (got.size() == expected.size()) return "";
  return std::to_string(got.size()) + " contacts instead of " + std::to_string(expected.size());
}

ContactScene::ContactScene(dSpaceID space) : space_(space), world_(dWorldCreate()) {}

ContactScene::~ContactScene() {
  for (const dGeomID geom : geoms_) {
    // What temporal coherence holds is freed only where ODE is told to.
    if (dGeomGetClass(geom) == dTriMeshClass) dGeomTriMeshClearTCCache(geom);
    dGeomDestroy(geom);
  }
  for (const auto& [kind, data] : heights_) dGeomHeightfieldDataDestroy(data);
  dWorldDestroy(world_);
}

dGeomID ContactScene::add(Kind kind, double side, std::uint64_t seed) {
  Random random(seed);
  const dGeomID geom = kKinds[static_cast<int>(kind)](heights_);
  geoms_.push_back(geom);
  dSpaceAdd(space_, geom);
  if (kind == Kind::Plane || kind == Kind::FixedHeightfield) return geom;
  placed_.push_back(geom);
  if (dGeomGetClass(geom) != dHeightfieldClass && kind != Kind::Ray) {
    dGeomSetBody(geom, dBodyCreate(world_));
    if (kind == Kind::OffsetBox) dGeomSetOffsetPosition(geom, real(0.1), real(-0.2), real(0.3));
  }
  dMatrix3 rotation;
  dRFromEulerAngles(rotation, real(random.between(-3, 3)), real(random.between(-3, 3)),
                    real(random.between(-3, 3)));
  dGeomSetRotation(geom, rotation);
  dGeomSetPosition(geom, real(random.between(0, side)), real(random.between(0, side)),
                   real(random.between(0, side)));
  return geom;
}

void ContactScene::fill(const std::vector<Kind>& kinds, std::size_t n, std::uint64_t seed) {
  const double side = 0.8 * std::cbrt(static_cast<double>(n));
  Random random(seed);
  for (std::size_t i = 0; i < n; ++i) add(kinds[i % kinds.size()], side, random.bits());
}

void ContactScene::move(std::uint64_t seed) {
  Random random(seed);
  for (const dGeomID geom : placed_) {
    const auto shift = [&] { return random.between(-0.1, 0.1); };
    const double x = shift(), y = shift();
    moveBy(geom, x, y, shift());
  }
}

bool userCodeKeptToThisThread() {
  return calls_elsewhere.exchange(0) == 0;
}

std::size_t userCodeCalls() {
  return calls.exchange(0);
}

void releaseContactShapes() {
  delete std::exchange(torus, nullptr);
}

}  // namespace sap_test
