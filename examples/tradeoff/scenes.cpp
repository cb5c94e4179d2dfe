// The study's own scenes, each run once: tradeoff-point NAME BODIES [--SETTING VALUE...]
#include "scenes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "../pile/random.h"

namespace tradeoff {
namespace {

using pile::Random;

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
    const Vector place = {cell * (i % across - (across - 1) / 2.0),
                          cell * (i / across % across - (across - 1) / 2.0),
                          1 + layer * (i / (across * across))};
    const dBodyID body = addBox(world, space, side, place);
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
    addBody(world, dCreateSphere(space, real(radius)), mass,
            {cell * (i % across - (across - 1) / 2.0) + random.uniform(-0.04, 0.04),
             cell * (i / across % across - (across - 1) / 2.0) + random.uniform(-0.04, 0.04),
             Plate::lowest + cell * across / 2.0 + 1 + cell * (i / (across * across))});
  }
}

// Through a plate, to its other side.
bool leftHopper(dBodyID body) {
  for (int i = 0; i < 4; ++i)
    if (Plate(i).above(vectorOf(dBodyGetPosition(body))) < 0) return true;
  return false;
}

Scene sceneNamed(const std::string& name, int bodies) {
  if (name == "vehicle") return vehicleScene(bodies);
  if (name == "meshes") return meshScene(bodies);
  using Build = void (*)(dWorldID, dSpaceID, Random, int);
  static const std::map<std::string, Build> builds = {
      {"heap", buildHeap}, {"hopper", buildHopper}, {"tower", buildTower}};
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
