#include "scenes.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "letters.h"
#include "shapes.h"

namespace pile {
namespace {

constexpr double two_pi = 6.283185307179586;

void turnAtRandom(dQuaternion rotation, Random& random) {
  // Uniform over all rotations (Shoemake, Graphics Gems III).
  const double u = random.uniform(0, 1);
  const double a = random.uniform(0, two_pi);
  const double b = random.uniform(0, two_pi);
  rotation[0] = static_cast<dReal>(std::sqrt(1 - u) * std::sin(a));
  rotation[1] = static_cast<dReal>(std::sqrt(1 - u) * std::cos(a));
  rotation[2] = static_cast<dReal>(std::sqrt(u) * std::sin(b));
  rotation[3] = static_cast<dReal>(std::sqrt(u) * std::cos(b));
}

// Places in the air: a square block of layers that follow the ground, far enough apart that no two
// bodies touch.
class DropBlock {
 public:
  // `diameter` is that of the ball about its centre of mass that holds the largest body; `bottom`
  // the height of the lowest centres over the ground.
  DropBlock(int bodies, int layers, double diameter, double bottom)
      : side_(static_cast<int>(std::ceil(std::sqrt(static_cast<double>(bodies) / layers)))),
        spacing_(diameter / (1 - 2 * jitter)),
        bottom_(bottom) {}

  double halfWidth() const { return 0.5 * spacing_ * side_; }

  Pose pose(int body, const World& world, Random& random) const {
    const int layer = body / (side_ * side_);
    const int row = body / side_ % side_;
    const int column = body % side_;
    const double middle = 0.5 * (side_ - 1);
    const auto near = [&](double grid) {
      return spacing_ * (grid + random.uniform(-jitter, jitter));
    };
    Pose pose;
    const double x = near(column - middle);
    const double y = near(row - middle);
    pose.position = {x, y, world.ground_height(x, y) + bottom_ + near(layer)};
    turnAtRandom(pose.rotation, random);
    return pose;
  }

 private:
  static constexpr double jitter = 0.08;  // in spacings

  int side_;
  double spacing_;
  double bottom_;
};

dGeomID meshGeom(dTriMeshDataID data) {
  return dCreateTriMesh(nullptr, data, nullptr, nullptr, nullptr);
}

void addPlane(World& world) {
  world.addStatic(dCreatePlane(nullptr, 0, 0, 1, 0));
  world.ground_name = "a plane";
  world.ground_height = [](double, double) { return 0.0; };
}

// Bodies that all have the one shape.
void addCopies(World& world, Mesh mesh, Mesh drawn, int bodies, const DropBlock& block,
               Random& random) {
  const dMass mass = centreOfMass(mesh, 1);
  centreOfMass(drawn, 1);
  const dTriMeshDataID data = world.addMesh(std::move(mesh), std::move(drawn));
  for (int i = 0; i < bodies; ++i)
    world.addBody(meshGeom(data), mass, block.pose(i, world, random));
}

void buildCubes(World& world, int bodies, Random& random) {
  const DropBlock block(bodies, 5, std::sqrt(3.0), 2);
  const double cell = 0.5 * std::max(1.0, block.halfWidth() / 68);
  const Terrain terrain(cell);
  for (int j = 0; j < Terrain::tiles_y; ++j)
    for (int i = 0; i < Terrain::tiles_x; ++i)
      world.addStatic(meshGeom(world.addMesh(terrain.tile(i, j))));
  world.ground_name = "a terrain of 240 tiles";
  world.ground_height = [terrain](double x, double y) { return terrain.height(x, y); };
  world.body_name = "boxes";
  world.body_size = 0.8;
  for (int i = 0; i < bodies; ++i) {
    dReal side[3];
    for (dReal& length : side) length = static_cast<dReal>(random.uniform(0.6, 1.0));
    dMass mass;
    dMassSetBox(&mass, 1, side[0], side[1], side[2]);
    world.addBody(dCreateBox(nullptr, side[0], side[1], side[2]), mass,
                  block.pose(i, world, random));
  }
}

void buildBalls(World& world, int bodies, Random& random) {
  const DropBlock block(bodies, 10, 1, 2);
  // The corners of the block hang over 0.8 of the bowl's radius.
  const Bowl bowl(std::max(8.0, block.halfWidth() * std::sqrt(2.0) / 0.8), 12);
  world.addStatic(meshGeom(world.addMesh(bowl.mesh())));
  world.ground_name = "a bowl";
  world.ground_height = [bowl](double x, double y) { return bowl.height(x, y); };
  world.body_name = "spheres";
  world.body_size = 0.8;
  for (int i = 0; i < bodies; ++i) {
    const dReal radius = static_cast<dReal>(random.uniform(0.3, 0.5));
    dMass mass;
    dMassSetSphere(&mass, 1, radius);
    world.addBody(dCreateSphere(nullptr, radius), mass, block.pose(i, world, random));
  }
}

void buildSkittles(World& world, int bodies, Random& random) {
  constexpr double height = 1.5;
  addPlane(world);
  world.body_name = "skittles";
  world.body_size = height;
  addCopies(world, makeSkittle(height, 100), makeSkittle(height, 24), bodies,
            DropBlock(bodies, 4, 1.9, 1.3), random);
}

void buildTorus(World& world, int bodies, Random& random) {
  addPlane(world);
  world.body_name = "tori";
  world.body_size = 1.4;
  const Mesh torus = makeTorus(0.5, 0.2);
  addCopies(world, torus, torus, bodies, DropBlock(bodies, 6, 1.4, 1.2), random);
}

void buildAlphabet(World& world, int bodies, Random& random) {
  addPlane(world);
  world.body_name = "letters";
  world.body_size = 1;
  const DropBlock block(bodies, 8, 2.1, 1.5);
  constexpr int shapes = letter_count * letter_variation_count;
  std::vector<dMass> masses;
  std::vector<dTriMeshDataID> meshes;
  for (int i = 0; i < std::min(bodies, shapes); ++i) {
    Mesh mesh = makeLetter(i % letter_count, i / letter_count);
    masses.push_back(centreOfMass(mesh, 1));
    meshes.push_back(world.addMesh(std::move(mesh)));
  }
  for (int i = 0; i < bodies; ++i) {
    const size_t shape = static_cast<size_t>(i % shapes);
    world.addBody(meshGeom(meshes[shape]), masses[shape], block.pose(i, world, random));
  }
}

}  // namespace

const std::vector<Preset>& presets() {
  // name, about, bodies, steps, dt, contacts, build
  static const std::vector<Preset> all = {
      {"cubes", "20,000 boxes onto a terrain of 300,000 triangles", 20000, 300, 0.01, 4,
       buildCubes},
      {"balls", "10,000 spheres into a bowl of 600 triangles", 10000, 450, 0.01, 2, buildBalls},
      {"skittles", "3,500 bowling pins of 20,000 triangles each onto a plane", 3500, 200, 0.005, 6,
       buildSkittles},
      {"torus", "1,000 tori of 2,304 triangles each onto a plane", 1000, 500, 0.005, 6, buildTorus},
      {"alphabet", "260 letters, all different, of 31,680 triangles in all onto a plane", 260, 4000,
       0.005, 6, buildAlphabet}};
  return all;
}

const Preset& presetOf(std::string_view name) {
  for (const Preset& preset : presets())
    if (name == preset.name) return preset;
  throw std::out_of_range("no scene " + std::string(name));
}

}  // namespace pile
