// The study's own scenes, each run once: tradeoff-point NAME BODIES [--SETTING VALUE...]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <list>
#include <memory>

#include "../pile/random.h"
#include "../pile/shapes.h"
#include "harness.h"

namespace tradeoff {
namespace {

using pile::Mesh;
using pile::Random;

constexpr double pi = 3.14159265358979;
constexpr double density = 1000;  // kg/m^3: water, wood, plastics; stone has 2,500, steel 8,000

dReal real(double value) {
  return static_cast<dReal>(value);
}

// A body with this geom, not damped: damping would hide errors; and what sleeps is for the settings
// to say.
dBodyID addBody(dWorldID world, dGeomID geom, const dMass& mass, const Vector& place) {
  const dBodyID body = dBodyCreate(world);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, real(place[0]), real(place[1]), real(place[2]));
  dGeomSetBody(geom, body);
  dBodySetLinearDamping(body, 0);
  dBodySetAngularDamping(body, 0);
  return body;
}

dBodyID addBox(dWorldID world, dSpaceID space, const Vector& side, const Vector& place) {
  dMass mass;
  dMassSetBox(&mass, real(density), real(side[0]), real(side[1]), real(side[2]));
  return addBody(world, dCreateBox(space, real(side[0]), real(side[1]), real(side[2])), mass,
                 place);
}

// The middle of a cell of a layer of `across` by `across` of them, above the origin; the layer's
// number is i / across^2.
Vector cellOf(int i, int across, double cell) {
  return {cell * (i % across - (across - 1) / 2.0),
          cell * (i / across % across - (across - 1) / 2.0), cell * (i / (across * across))};
}

// Boxes of 0.6 to 1 m in layers over a pit of planes that is about as wide as a layer, tilted a
// little so that they do not stack like bricks.
void buildHeap(dWorldID world, dSpaceID space, Random random, int bodies) {
  constexpr double cell = 1.6;
  constexpr double layer = 1.25;
  constexpr double tilt = 0.1;  // radians
  const int across = std::max(2, static_cast<int>(std::lround(std::cbrt(bodies / 2.0))));
  const dReal wall = real(-cell * across / 2);
  dCreatePlane(space, 0, 0, 1, 0);
  for (int sign : {1, -1}) {
    dCreatePlane(space, real(sign), 0, 0, wall);
    dCreatePlane(space, 0, real(sign), 0, wall);
  }
  for (int i = 0; i < bodies; ++i) {
    Vector side;
    for (double& length : side) length = random.uniform(0.6, 1.0);
    const Vector at = cellOf(i, across, cell);
    const dBodyID body =
        addBox(world, space, side, {at[0], at[1], 1 + layer * (i / (across * across))});
    const double angle = random.uniform(0, pi);
    dQuaternion turn = {real(std::cos(angle / 2)), real(random.uniform(-tilt, tilt)),
                        real(random.uniform(-tilt, tilt)), real(std::sin(angle / 2))};
    dBodySetQuaternion(body, turn);
  }
}

// Cubes of 1 m on one another, each up to 2 cm beside the one below.
void buildTower(dWorldID world, dSpaceID space, Random random, int bodies) {
  dCreatePlane(space, 0, 0, 1, 0);
  for (int i = 0; i < bodies; ++i)
    addBox(world, space, {1, 1, 1},
           {random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), 0.5 + 1.001 * i});
}

// One of the hopper's four plates, which slope down to its lowest point. Theirs is the inner side.
struct Plate {
  static constexpr double lowest = 1;  // metres above the ground
  static constexpr double length = 8;
  static constexpr double thick = 0.2;

  explicit Plate(int number) {
    const double angle = number * pi / 2;
    const double half = std::sqrt(0.5);
    outwards = {half * std::cos(angle), half * std::sin(angle), half};
    sideways = {-std::sin(angle), std::cos(angle), 0};
    normal = {-half * std::cos(angle), -half * std::sin(angle), half};
  }

  double above(const Vector& place) const { return dot(normal, minus(place, {0, 0, lowest})); }

  Vector outwards, sideways, normal;
};

void addPlate(dSpaceID space, const Plate& plate) {
  const dGeomID geom = dCreateBox(space, Plate::length, 2 * Plate::length, real(Plate::thick));
  dMatrix3 turn = {};
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<size_t>(i);
    turn[4 * i] = real(plate.outwards[axis]);
    turn[4 * i + 1] = real(plate.sideways[axis]);
    turn[4 * i + 2] = real(plate.normal[axis]);
  }
  Vector place = {0, 0, Plate::lowest};
  addScaled(place, Plate::length / 2, plate.outwards);
  addScaled(place, -Plate::thick / 2, plate.normal);
  dGeomSetRotation(geom, turn);
  dGeomSetPosition(geom, real(place[0]), real(place[1]), real(place[2]));
}

// Balls of 0.5 to 0.9 m that fall into the hopper, which is shut.
void buildHopper(dWorldID world, dSpaceID space, Random random, int bodies) {
  constexpr double cell = 1;
  dCreatePlane(space, 0, 0, 1, 0);
  for (int i = 0; i < 4; ++i) addPlate(space, Plate(i));
  const int across = std::max(2, static_cast<int>(std::lround(std::cbrt(bodies))));
  for (int i = 0; i < bodies; ++i) {
    const double radius = random.uniform(0.25, 0.45);
    dMass mass;
    dMassSetSphere(&mass, real(density), real(radius));
    const Vector at = cellOf(i, across, cell);
    addBody(world, dCreateSphere(space, real(radius)), mass,
            {at[0] + random.uniform(-0.04, 0.04), at[1] + random.uniform(-0.04, 0.04),
             Plate::lowest + cell * across / 2.0 + 1 + at[2]});
  }
}

// Through a plate, to its other side.
bool leftHopper(dBodyID body) {
  for (int i = 0; i < 4; ++i)
    if (Plate(i).above(vectorOf(dBodyGetPosition(body))) < 0) return true;
  return false;
}

constexpr int bodies_each = 5;
constexpr double lane = 4;  // metres from one vehicle to the next
constexpr double chassis_length = 1.6;
constexpr double chassis_width = 0.8;
constexpr double wheel = 0.3;  // radius
constexpr double bump_radius = 0.5;
constexpr double drives = 4;     // seconds, then it brakes
constexpr double speed = 3;      // m/s
constexpr double torque = 150;   // N m, of each wheel's motor
constexpr double bounces = 2;    // Hz, of the chassis on its springs
constexpr double damping = 0.5;  // of the critical one

class Fleet {
 public:
  explicit Fleet(int count) : count_(count) {}

  void build(dWorldID world, dSpaceID space, unsigned long seed) {
    Random random(seed);
    dCreatePlane(space, 0, 0, 1, 0);
    for (int i = 0; i < count_; ++i) {
      const double y = lane * i;
      addBumps(space, random, y);
      const dBodyID chassis =
          addBox(world, space, {chassis_length, chassis_width, 0.3}, {0, y, wheel + 0.35});
      chassis_.push_back(chassis);
      for (double x : {-0.6, 0.6})
        for (double side : {-0.5, 0.5}) addWheel(world, space, chassis, {x, y + side, wheel});
    }
  }

  // A spring of so much stiffness and damping is another ERP and CFM with each step.
  void prepare(double dt) {
    const double rate = 2 * pi * bounces;
    for (size_t i = 0; i < axles_.size(); ++i) {
      const double load = massOf(chassis_[i / 4]) / 4;
      const double stiffness = load * rate * rate, resistance = 2 * damping * load * rate;
      const double both = dt * stiffness + resistance;
      dJointSetHinge2Param(axles_[i], dParamSuspensionERP, real(dt * stiffness / both));
      dJointSetHinge2Param(axles_[i], dParamSuspensionCFM, real(1 / both));
    }
  }

  void control(double time) {
    for (dJointID axle : axles_)
      dJointSetHinge2Param(axle, dParamVel2, real(time < drives ? speed / wheel : 0));
  }

  // Off by its own length is an error of 100 %.
  std::vector<Observation> observe() const {
    std::vector<Observation> seen;
    for (size_t i = 0; i < chassis_.size(); ++i) {
      const Vector place = vectorOf(dBodyGetPosition(chassis_[i]));
      seen.push_back({"way_" + std::to_string(i + 1), place[0], chassis_length});
      seen.push_back(
          {"aside_" + std::to_string(i + 1), place[1] - lane * double(i), chassis_length});
    }
    return seen;
  }

 private:
  // Round bars across half of the lane, on either side by chance, 2 to 6 cm high.
  static void addBumps(dSpaceID space, Random& random, double y) {
    dMatrix3 across;
    dRFromAxisAndAngle(across, 1, 0, 0, real(pi / 2));
    for (double x = 2; x < speed * drives + 2; x += random.uniform(0.8, 1.4)) {
      const double high = random.uniform(0.02, 0.06), side = random.uniform(-1, 1);
      const dGeomID bump = dCreateCapsule(space, real(bump_radius), 1);
      dGeomSetRotation(bump, across);
      dGeomSetPosition(bump, real(x), real(y + side), real(high - bump_radius));
    }
  }

  // It collides as a ball, and weighs what a disc does.
  void addWheel(dWorldID world, dSpaceID space, dBodyID chassis, const Vector& place) {
    dMass mass;
    dMassSetCylinder(&mass, real(density), 2, real(wheel), real(0.2));
    const dBodyID body = addBody(world, dCreateSphere(space, real(wheel)), mass, place);
    const dJointID axle = dJointCreateHinge2(world, nullptr);
    dJointAttach(axle, chassis, body);
    const dVector3 up = {0, 0, 1}, across = {0, -1, 0};
    dJointSetHinge2Anchor(axle, real(place[0]), real(place[1]), real(place[2]));
    dJointSetHinge2Axes(axle, up, across);
    dJointSetHinge2Param(axle, dParamLoStop, 0);  // not steered
    dJointSetHinge2Param(axle, dParamHiStop, 0);
    dJointSetHinge2Param(axle, dParamFMax2, real(torque));
    axles_.push_back(axle);
  }

  int count_;
  std::vector<dBodyID> chassis_;
  std::vector<dJointID> axles_;  // four for each
};

// Vehicles of five bodies each drive over bumps for some seconds, brake and stand.
Scene vehicleScene(int bodies) {
  const auto fleet = std::make_shared<Fleet>(std::max(1, bodies / bodies_each));
  Scene scene;
  scene.build = [fleet](dWorldID world, dSpaceID space, unsigned long seed) {
    fleet->build(world, space, seed);
  };
  scene.prepare = [fleet](double dt) { fleet->prepare(dt); };
  scene.control = [fleet](double time) { fleet->control(time); };
  scene.observe = [fleet] { return fleet->observe(); };
  scene.seconds = 10;
  return scene;
}

// The corners of an icosahedron, at 1 from its centre.
std::vector<Vector> corners() {
  const double golden = (1 + std::sqrt(5.0)) / 2, unit = 1 / std::sqrt(1 + golden * golden);
  std::vector<Vector> all;
  for (size_t axis = 0; axis < 3; ++axis)
    for (double one : {-unit, unit})
      for (double other : {-unit * golden, unit * golden}) {
        Vector corner = {0, 0, 0};
        corner[(axis + 1) % 3] = one;
        corner[(axis + 2) % 3] = other;
        all.push_back(corner);
      }
  return all;
}

// An icosahedron of these half axes, which is convex however it is stretched. Its 20 triangles are
// those of three corners as close to each other as there are.
Mesh pebble(const Vector& half) {
  const std::vector<Vector> all = corners();
  Mesh mesh;
  for (const Vector& corner : all)
    mesh.points.push_back({static_cast<float>(half[0] * corner[0]),
                           static_cast<float>(half[1] * corner[1]),
                           static_cast<float>(half[2] * corner[2])});
  const auto close = [&all](size_t a, size_t b) { return length(minus(all[a], all[b])) < 1.1; };
  for (size_t i = 0; i < all.size(); ++i)
    for (size_t j = i + 1; j < all.size(); ++j)
      for (size_t k = j + 1; k < all.size(); ++k) {
        if (!close(i, j) || !close(j, k) || !close(i, k)) continue;
        const bool outwards = dot(all[i], cross(all[j], all[k])) > 0;
        const auto index = [](size_t corner) { return static_cast<dTriIndex>(corner); };
        mesh.triangles.push_back({index(i), index(outwards ? j : k), index(outwards ? k : j)});
      }
  return mesh;
}

// ODE reads triangles where they are, until the program ends.
dGeomID addMesh(dSpaceID space, Mesh made) {
  struct Stored {
    Mesh mesh;
    std::unique_ptr<dxTriMeshData, decltype(&dGeomTriMeshDataDestroy)> data;
  };
  static std::list<Stored> all;
  all.push_back({std::move(made), {dGeomTriMeshDataCreate(), dGeomTriMeshDataDestroy}});
  const Mesh& mesh = all.back().mesh;
  const dTriMeshDataID data = all.back().data.get();
  dGeomTriMeshDataBuildSingle(data, mesh.points.data(), sizeof(Mesh::Point),
                              static_cast<int>(mesh.points.size()), mesh.triangles.data(),
                              static_cast<int>(3 * mesh.triangles.size()), sizeof(Mesh::Triangle));
  return dCreateTriMesh(space, data, nullptr, nullptr, nullptr);
}

constexpr double pebbles_apart = 1.1;  // metres, at the start

// Bodies of 20 triangles each fall into a bowl.
void buildMeshes(dWorldID world, dSpaceID space, Random random, int bodies) {
  const int across = std::max(2, static_cast<int>(std::lround(std::cbrt(bodies))));
  const double radius = 1 + pebbles_apart * across;
  addMesh(space, pile::Bowl(radius, radius / 2).mesh());
  for (int i = 0; i < bodies; ++i) {
    Vector half;
    for (double& axis : half) axis = random.uniform(0.3, 0.5);
    Mesh mesh = pebble(half);
    const dMass mass = pile::centreOfMass(mesh, density);
    const Vector at = cellOf(i, across, pebbles_apart);
    const double x = at[0] + random.uniform(-0.04, 0.04), y = at[1] + random.uniform(-0.04, 0.04);
    const dBodyID body =
        addBody(world, addMesh(space, std::move(mesh)), mass, {x, y, radius / 2 + at[2]});
    dQuaternion turn;
    for (dReal& part : turn) part = real(random.uniform(-1, 1));
    dNormalize4(turn);
    dBodySetQuaternion(body, turn);
  }
}

Scene sceneNamed(const std::string& name, int bodies) {
  if (name == "vehicle") return vehicleScene(bodies);
  using Build = void (*)(dWorldID, dSpaceID, Random, int);
  static const std::map<std::string, Build> builds = {
      {"heap", buildHeap}, {"hopper", buildHopper}, {"meshes", buildMeshes}, {"tower", buildTower}};
  const auto found = builds.find(name);
  if (found == builds.end()) throw std::invalid_argument("no such scene: " + name);
  Scene scene;
  scene.build = [build = found->second, bodies](dWorldID world, dSpaceID space,
                                                unsigned long seed) {
    build(world, space, Random(seed), bodies);
  };
  scene.seconds = 20;
  scene.stands = name == "tower";
  if (name == "hopper") scene.lost = leftHopper;
  if (name == "meshes")  // through the bowl, whose lowest point is at 0
    scene.lost = [](dBodyID body) { return dBodyGetPosition(body)[2] < 0; };
  return scene;
}

}  // namespace
}  // namespace tradeoff

int main(int argc, char** argv) {
  try {
    if (argc < 3) throw std::invalid_argument("which scene, and of how many bodies?");
    const tradeoff::Scene scene = tradeoff::sceneNamed(argv[1], std::max(1, std::atoi(argv[2])));
    return tradeoff::run(argc - 2, argv + 2, scene);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 2;
  }
}
