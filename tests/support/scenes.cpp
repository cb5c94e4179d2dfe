#include "scenes.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "mesh.h"
#include "random.h"
#include "recorder.h"
#include "user_box.h"

namespace sap_test {
namespace {

Box boxAround(double x, double y, double z, double width, double depth, double height) {
  return Box{{x - width / 2, y - depth / 2, z - height / 2},
             {x + width / 2, y + depth / 2, z + height / 2}};
}

Box unitBoxAround(double x, double y, double z) {
  return boxAround(x, y, z, 1, 1, 1);
}

template <class Make>
Boxes boxesOf(std::size_t n, Make make) {
  Boxes boxes;
  while (boxes.size() < n) boxes.push_back(make());
  return boxes;
}

// Anywhere in a cuboid.
Boxes unitBoxesIn(double width, double depth, double height, std::size_t n, Random& random) {
  return boxesOf(n, [&] {
    const double x = random.between(0, width), y = random.between(0, depth);
    return unitBoxAround(x, y, random.between(0, height));
  });
}

Box shifted(Box box, int axis, double by) {
  box.low[axis] += by;
  box.high[axis] += by;
  return box;
}

// Log-uniform sizes down to 10^-decades of the largest, which is 1.
Boxes decades(std::size_t n, double decades, std::uint64_t seed) {
  Random random(seed);
  const double side = 0.6 * std::cbrt(2 / decades * static_cast<double>(n));
  return boxesOf(n, [&] {
    const double size = std::pow(10, -decades * random.unit());
    return boxAround(random.between(0, side), random.between(0, side), random.between(0, side),
                     size * random.between(0.5, 1), size, size * random.between(0.5, 1));
  });
}

}  // namespace

Boxes denseCube(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const double side = 0.95 * std::cbrt(static_cast<double>(n));
  return unitBoxesIn(side, side, side, n, random);
}

Boxes flatLayer(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const double side = 0.67 * std::sqrt(static_cast<double>(n));
  return unitBoxesIn(side, side, 0.1, n, random);
}

Boxes straightLine(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const double length = 0.25 * static_cast<double>(n);
  return boxesOf(n, [&] { return unitBoxAround(random.between(0, length), 0, 0); });
}

Boxes clusters(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const std::size_t count = 1 + n / 200;
  const double side = 10 * std::cbrt(static_cast<double>(n));
  const Boxes centres = unitBoxesIn(side, side, side, count, random);
  return boxesOf(n, [&] {
    Box box = centres[random.below(count)];
    for (int axis = 0; axis < 3; ++axis) box = shifted(box, axis, 2.5 * random.gauss());
    return box;
  });
}

Boxes twoDecades(std::size_t n, std::uint64_t seed) {
  return decades(n, 2, seed);
}

Boxes sixDecades(std::size_t n, std::uint64_t seed) {
  return decades(n, 6, seed);
}

Boxes giantAmongDust(std::size_t n, std::uint64_t seed) {
  Boxes boxes = denseCube(n, seed);
  if (n == 0) return boxes;
  Random random(seed + 1);
  const double side = std::cbrt(static_cast<double>(n));
  boxes[random.below(n)] = boxAround(side / 2, side / 2, side / 2, 3 * side, 3 * side, 3 * side);
  return boxes;
}

Boxes touchingLattice(std::size_t n, std::uint64_t seed) {
  std::size_t side = 0;
  while (side * side * side < n) ++side;
  Boxes boxes;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = static_cast<double>(i % side), y = static_cast<double>(i / side % side),
                 z = static_cast<double>(i / side / side);
    boxes.push_back(Box{{x, y, z}, {x + 1, y + 1, z + 1}});
  }
  Random random(seed);
  shuffle(boxes.data(), boxes.size(), random);
  return boxes;
}

Boxes onePlace(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  return Boxes(n, unitBoxAround(random.between(-5, 5), random.between(-5, 5), 0));
}

Boxes longBars(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const double side = 4 * std::cbrt(static_cast<double>(n));
  return boxesOf(n, [&] {
    double size[3] = {1, 1, 1};
    size[random.below(3)] = std::max(1.0, side / 4);
    return boxAround(random.between(0, side), random.between(0, side), random.between(0, side),
                     size[0], size[1], size[2]);
  });
}

Boxes farClusters(std::size_t n, std::uint64_t seed) {
  Boxes boxes = denseCube(n / 2, seed);
  for (const Box& box : denseCube(n - n / 2, seed + 1))
    boxes.push_back(shifted(shifted(shifted(box, 0, 1e6), 1, 1e6), 2, 1e6));
  Random random(seed + 2);
  shuffle(boxes.data(), boxes.size(), random);
  return boxes;
}

Boxes heap(std::size_t n, std::uint64_t seed) {
  // A cone of height h and radius 2 h holds 4/3 pi h^3 of boxes packed to about 0.6.
  const double height = std::cbrt(static_cast<double>(n) / 0.6 / 4.19);
  Random random(seed);
  Boxes boxes;
  while (boxes.size() < n) {
    const double x = random.between(-2 * height, 2 * height),
                 y = random.between(-2 * height, 2 * height), z = random.between(0, height);
    if (std::sqrt(x * x + y * y) > 2 * (height - z)) continue;
    boxes.push_back(unitBoxAround(x, y, z + 0.5));
  }
  return boxes;
}

const std::vector<BoxScene>& boxScenes() {
  static const std::vector<BoxScene> scenes = {
      {"dense cube", denseCube},
      {"flat layer", flatLayer},
      {"straight line", straightLine},
      {"clusters", clusters},
      {"two decades of size", twoDecades},
      {"six decades of size", sixDecades},
      {"giant among dust", giantAmongDust},
      {"touching lattice", touchingLattice},
      {"one place", onePlace},
      {"long bars", longBars},
      {"far clusters", farClusters},
      {"heap", heap},
  };
  return scenes;
}

const StockSpace kStockSpaces[] = {
    {"dSimpleSpace", dSimpleSpaceCreate},
    {"dHashSpace", dHashSpaceCreate},
    {"dSweepAndPruneSpace",
     [](dSpaceID parent) { return dSweepAndPruneSpaceCreate(parent, dSAP_AXES_XYZ); }},
    {"dQuadTreeSpace", [](dSpaceID parent) {
       const dVector3 centre = {0, 0, 0, 0}, extents = {1000, 1000, 1000, 0};
       return dQuadTreeSpaceCreate(parent, centre, extents, 3);
     }}};

void moveBy(dGeomID geom, double x, double y, double z) {
  const dReal* const at = dGeomGetPosition(geom);
  dGeomSetPosition(geom, at[0] + real(x), at[1] + real(y), at[2] + real(z));
}

World::World(dSpaceID space, const Boxes& boxes) : space_(space), dynamics_(dWorldCreate()) {
  addBoxes(boxes);
}

World::~World() {
  for (const dGeomID geom : geoms_) dGeomDestroy(geom);
  dWorldDestroy(dynamics_);
}

dGeomID World::take(dGeomID geom) {
  if (!dGeomGetSpace(geom)) dSpaceAdd(space_, geom);
  setNumber(geom, geoms_.size());
  geoms_.push_back(geom);
  return geom;
}

dGeomID World::addBox(const Box& box) {
  dReal centre[3], length[3];
  for (int axis = 0; axis < 3; ++axis) {
    centre[axis] = real((box.low[axis] + box.high[axis]) / 2);
    length[axis] = real(box.high[axis] - box.low[axis]);
  }
  const dGeomID geom = dCreateBox(space_, length[0], length[1], length[2]);
  dGeomSetPosition(geom, centre[0], centre[1], centre[2]);
  return take(geom);
}

void World::addBoxes(const Boxes& boxes) {
  for (const Box& box : boxes) addBox(box);
}

void World::remove(dGeomID geom) {
  // From the back: whole worlds are emptied in that order.
  const auto at = std::find(geoms_.rbegin(), geoms_.rend(), geom);
  if (at == geoms_.rend()) throw std::logic_error("World::remove: no geom of this world");
  dSpaceRemove(space_, geom);
  geoms_.erase(std::next(at).base());
}

void World::addAgain(dGeomID geom) {
  dSpaceAdd(space_, geom);
  geoms_.push_back(geom);
}

void World::shrinkTo(std::size_t geoms) {
  while (geoms_.size() > geoms) {
    dGeomDestroy(geoms_.back());
    geoms_.pop_back();
  }
}

dBodyID World::giveBody(dGeomID geom) {
  const dBodyID body = dBodyCreate(dynamics_);
  const dReal* position = dGeomGetPosition(geom);
  dBodySetPosition(body, position[0], position[1], position[2]);
  dBodySetRotation(body, dGeomGetRotation(geom));
  dGeomSetBody(geom, body);
  bodies_.push_back(body);
  return body;
}

void World::jitter(double distance, std::uint64_t seed) {
  Random random(seed);
  for (const dGeomID geom : geoms_) {
    const auto shift = [&] { return random.between(-distance, distance); };
    const double x = shift(), y = shift(), z = shift();
    if (dGeomGetClass(geom) == dPlaneClass || dGeomIsSpace(geom)) continue;
    moveBy(geom, x, y, z);
  }
}

namespace {

void placeInDenseCube(dGeomID geom, std::size_t n, Random& random) {
  const double side = 0.95 * std::cbrt(static_cast<double>(n));
  const double x = random.between(0, side), y = random.between(0, side);
  dGeomSetPosition(geom, real(x), real(y), real(random.between(0, side)));
}

void turn(dGeomID geom, Random& random) {
  dMatrix3 rotation;
  dRFromEulerAngles(rotation, real(random.between(-3, 3)), real(random.between(-3, 3)),
                    real(random.between(-3, 3)));
  dGeomSetRotation(geom, rotation);
}

void spheres(World& world, std::size_t n, std::uint64_t seed) {
  Random random(seed);
  for (std::size_t i = 0; i < n; ++i) {
    placeInDenseCube(world.take(dCreateSphere(world.space(), dReal(0.5))), n, random);
  }
}

// Oblique and axis-aligned planes in both directions, walls as large as the scene, the rest boxes.
void planesAndWalls(World& world, std::size_t n, std::uint64_t seed) {
  Random random(seed);
  const double side = std::cbrt(static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t kind = random.below(40);
    const dReal at = real(random.between(0, side));
    const dReal sign = random.chance(0.5) ? 1 : -1;
    if (kind == 0) {
      dReal normal[3] = {0, 0, 0};
      normal[random.below(3)] = sign;
      world.take(dCreatePlane(world.space(), normal[0], normal[1], normal[2], sign * at));
    } else if (kind == 1) {
      world.take(dCreatePlane(world.space(), sign, 1, real(0.5), at));
    } else if (kind == 2) {
      double size[3] = {2 * side, 2 * side, 2 * side};
      size[random.below(3)] = 0.1;
      world.addBox(
          boxAround(side / 2, side / 2, static_cast<double>(at), size[0], size[1], size[2]));
    } else {
      placeInDenseCube(world.take(dCreateBox(world.space(), 1, 1, 1)), n, random);
    }
  }
}

// Two to five geoms on a body, half of them away from its centre.
void sharedBodies(World& world, std::size_t n, std::uint64_t seed) {
  Random random(seed);
  dBodyID body = nullptr;
  std::size_t left = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const dGeomID geom = world.take(dCreateBox(world.space(), 1, 1, 1));
    placeInDenseCube(geom, n, random);
    if (left == 0) {
      body = world.giveBody(geom);
      left = 1 + random.below(4);
      continue;
    }
    --left;
    dGeomSetBody(geom, body);
    if (random.chance(0.5)) {
      dGeomSetOffsetPosition(geom, real(random.between(-1, 1)), real(random.between(-1, 1)), 0);
    }
  }
}

void mixedBits(World& world, std::size_t n, std::uint64_t seed) {
  // The top one, or the one for which all above it may stand.
  const unsigned long top = 1ul << (seed % 2 ? 8 * sizeof(long) - 1 : 31);
  Random random(seed);
  for (const Box& box : denseCube(n, seed)) {
    const dGeomID geom = world.addBox(box);
    dGeomSetCategoryBits(geom, 1ul << random.below(4));
    dGeomSetCollideBits(geom, random.below(16));
    if (random.chance(0.05)) dGeomSetCategoryBits(geom, top);
    if (random.chance(0.05)) dGeomSetCollideBits(geom, random.chance(0.5) ? top : ~top);
    if (random.chance(0.1)) dGeomDisable(geom);
    if (random.chance(0.1)) dGeomBoxSetLengths(geom, 1, 0, 1);
  }
}

void allClasses(World& world, std::size_t n, std::uint64_t seed) {
  Random random(seed);
  for (std::size_t i = 0; i < n; ++i) {
    // Few planes: each is in touch with about every other geom.
    std::size_t kind = random.below(shapes().size());
    if (!shapes()[kind].placeable && random.chance(0.95)) kind = 0;
    const dGeomID geom = world.take(shapes()[kind].create(world.space()));
    if (!shapes()[kind].placeable) continue;
    placeInDenseCube(geom, n, random);
    turn(geom, random);
    if (random.chance(0.5)) world.giveBody(geom);
  }
}

}  // namespace

const std::vector<WorldScene>& worldScenes() {
  static const std::vector<WorldScene> scenes = [] {
    std::vector<WorldScene> all;
    for (const BoxScene& scene : boxScenes()) {
      const auto make = scene.make;
      all.push_back({scene.name, make == onePlace ? std::size_t{300} : std::size_t{1000000},
                     [make](World& world, std::size_t n, std::uint64_t seed) {
                       world.addBoxes(make(n, seed));
                     }});
    }
    all.push_back({"spheres", 1000000, spheres});
    all.push_back({"planes and walls", 3000, planesAndWalls});
    all.push_back({"shared bodies", 1000000, sharedBodies});
    all.push_back({"mixed bits", 1000000, mixedBits});
    all.push_back({"all classes", 3000, allClasses});
    return all;
  }();
  return scenes;
}

namespace {

dReal kCubePlanes[24] = {1, 0,  0, 0.5, -1, 0, 0, 0.5, 0, 1, 0,  0.5,
                         0, -1, 0, 0.5, 0,  0, 1, 0.5, 0, 0, -1, 0.5};
dReal kCubePoints[24] = {-0.5, -0.5, -0.5, 0.5, -0.5, -0.5, -0.5, 0.5, -0.5, 0.5, 0.5, -0.5,
                         -0.5, -0.5, 0.5,  0.5, -0.5, 0.5,  -0.5, 0.5, 0.5,  0.5, 0.5, 0.5};
unsigned kCubePolygons[30] = {4, 1, 3, 7, 5, 4, 0, 4, 6, 2, 4, 2, 6, 7, 3,
                              4, 0, 1, 5, 4, 4, 4, 5, 7, 6, 4, 0, 2, 3, 1};

Mesh* mesh = nullptr;
dHeightfieldDataID height_data = nullptr;

dGeomID createTriMesh(dSpaceID space) {
  if (!mesh) mesh = new Mesh(tetrahedron(0, 0, 0.5f));
  return mesh->create(space);
}

dGeomID createHeightfield(dSpaceID space) {
  if (!height_data) {
    const float heights[9] = {0, 0.5f, 0, 0.25f, 1, 0.5f, 0, 0, 0.25f};
    height_data = dGeomHeightfieldDataCreate();
    dGeomHeightfieldDataBuildSingle(height_data, heights, 1, 2, 2, 3, 3, 1, 0, 0, 0);
  }
  return dCreateHeightfield(space, height_data, 1);
}

int rejectsUpperOnes(dGeomID, dGeomID, dReal bounds[6]) {
  return bounds[4] < 2;
}

}  // namespace

const std::vector<Shape>& shapes() {
  static const std::vector<Shape> all = {
      {"sphere", [](dSpaceID space) { return dCreateSphere(space, dReal(0.5)); }, true},
      {"box", [](dSpaceID space) { return dCreateBox(space, 1, dReal(0.8), dReal(0.6)); }, true},
      {"capsule", [](dSpaceID space) { return dCreateCapsule(space, dReal(0.25), dReal(0.5)); },
       true},
      {"cylinder", [](dSpaceID space) { return dCreateCylinder(space, dReal(0.4), 1); }, true},
      {"ray", [](dSpaceID space) { return dCreateRay(space, 2); }, true},
      {"convex",
       [](dSpaceID space) {
         return dCreateConvex(space, kCubePlanes, 6, kCubePoints, 8, kCubePolygons);
       },
       true},
      {"trimesh", createTriMesh, true},
      {"heightfield", createHeightfield, true},
      {"geom transform",
       [](dSpaceID space) {
         const dGeomID carried = dCreateBox(nullptr, 1, dReal(0.5), 1);
         dGeomSetPosition(carried, dReal(0.25), 0, 0);
         return createTransform(space, carried);
       },
       true},
      {"user class with AABBTest",
       [](dSpaceID space) {
         const dReal half = dReal(0.5);
         return createUserBox(space, {-half, half, -half, half, -half, half}, true,
                              rejectsUpperOnes);
       },
       true},
      {"user class without AABBTest",
       [](dSpaceID space) {
         return createUserBoxWithoutTest(space, {0, 1, 0, 1, 0, 1});
       },
       true},
      {"plane along an axis", [](dSpaceID space) { return dCreatePlane(space, 0, 0, 1, 1); },
       false},
      {"oblique plane", [](dSpaceID space) { return dCreatePlane(space, 1, 2, 3, 4); }, false},
  };
  return all;
}

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
dGeomID createTransform(dSpaceID space, dGeomID carried) {
  const dGeomID geom = dCreateGeomTransform(space);
  dGeomTransformSetGeom(geom, carried);
  dGeomTransformSetCleanup(geom, 1);
  return geom;
}
#pragma GCC diagnostic pop

void releaseShapes() {
  delete std::exchange(mesh, nullptr);
  if (height_data) dGeomHeightfieldDataDestroy(std::exchange(height_data, nullptr));
}

}  // namespace sap_test
