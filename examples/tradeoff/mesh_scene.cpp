#include "scenes.h"

#include <list>
#include <memory>

#include "../pile/random.h"
#include "../pile/shapes.h"

namespace tradeoff {
namespace {

using pile::Mesh;
using pile::Random;

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

// ODE reads triangles where they are.
class Meshes {
 public:
  Meshes() = default;
  ~Meshes() {
    for (const Stored& stored : stored_) dGeomTriMeshDataDestroy(stored.data);
  }
  Meshes(const Meshes&) = delete;
  Meshes& operator=(const Meshes&) = delete;

  dGeomID geom(dSpaceID space, Mesh mesh) {
    stored_.push_back({std::move(mesh), dGeomTriMeshDataCreate()});
    const Stored& stored = stored_.back();
    dGeomTriMeshDataBuildSingle(
        stored.data, stored.mesh.points.data(), sizeof(Mesh::Point),
        static_cast<int>(stored.mesh.points.size()), stored.mesh.triangles.data(),
        static_cast<int>(3 * stored.mesh.triangles.size()), sizeof(Mesh::Triangle));
    return dCreateTriMesh(space, stored.data, nullptr, nullptr, nullptr);
  }

 private:
  struct Stored {
    Mesh mesh;
    dTriMeshDataID data;
  };
  std::list<Stored> stored_;
};

constexpr double cell = 1.1;  // metres between pebbles at the start

double bowlRadius(int across) {
  return 1 + cell * across;
}

void build(dWorldID world, dSpaceID space, Random random, Meshes& meshes, int bodies) {
  const int across = std::max(2, static_cast<int>(std::lround(std::cbrt(bodies))));
  const double radius = bowlRadius(across);
  meshes.geom(space, pile::Bowl(radius, radius / 2).mesh());
  for (int i = 0; i < bodies; ++i) {
    Vector half;
    for (double& axis : half) axis = random.uniform(0.3, 0.5);
    Mesh mesh = pebble(half);
    const dMass mass = pile::centreOfMass(mesh, density);
    const auto place = [&random, across](int number) {
      return cell * (number % across - (across - 1) / 2.0) + random.uniform(-0.04, 0.04);
    };
    const double x = place(i), y = place(i / across);
    const dBodyID body = addBody(world, meshes.geom(space, std::move(mesh)), mass,
                                 {x, y, radius / 2 + cell * (i / (across * across))});
    dQuaternion turn;
    for (dReal& part : turn) part = real(random.uniform(-1, 1));
    dNormalize4(turn);
    dBodySetQuaternion(body, turn);
  }
}

}  // namespace

Scene meshScene(int bodies) {
  const auto meshes = std::make_shared<Meshes>();
  Scene scene;
  scene.build = [meshes, bodies](dWorldID world, dSpaceID space, unsigned long seed) {
    build(world, space, Random(seed), *meshes, bodies);
  };
  // Through the bowl, whose lowest point is at 0.
  scene.lost = [](dBodyID body) { return dBodyGetPosition(body)[2] < 0; };
  scene.seconds = 20;
  return scene;
}

}  // namespace tradeoff
