#ifndef PILE_WORLD_H
#define PILE_WORLD_H

#include <ode/ode.h>

#include <array>
#include <functional>
#include <list>
#include <string>
#include <vector>

#include "mesh.h"

namespace pile {

struct Pose {
  std::array<double, 3> position;
  dQuaternion rotation;
};

// Of all bodies at one moment.
struct State {
  size_t asleep = 0;
  size_t lost = 0;         // centres below the ground, or nowhere
  double mean_height = 0;  // of the centres, metres
};

// Everything that is simulated: the ODE world, its bodies and its geoms, and the meshes they use.
// One World lives at a time: ODE is opened with it and closed with it.
class World {
 public:
  World();
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // Building, used by the scenes. The world owns what it is given. `drawn` is drawn in place of the
  // mesh.
  dTriMeshDataID addMesh(Mesh mesh);
  dTriMeshDataID addMesh(Mesh mesh, Mesh drawn);
  void addStatic(dGeomID geom);
  void addBody(dGeomID geom, const dMass& mass, const Pose& pose);

  // What to draw for a trimesh geom of this world.
  const Mesh& drawnMeshOf(dGeomID geom) const;

  // Puts all geoms into the space, in the order in which they were added, and owns it from now on;
  // one that they were in before is destroyed.
  void useSpace(dSpaceID space);

  dWorldID ode() const { return ode_; }
  dSpaceID space() const { return space_; }
  const std::vector<dBodyID>& bodies() const { return bodies_; }
  const std::vector<dGeomID>& geoms() const { return geoms_; }
  State state() const;
  size_t staticTriangles() const { return static_triangles_; }
  size_t bodyTriangles() const { return body_triangles_; }

  // Position of a geom of this world in geoms().
  static size_t indexOf(dGeomID geom);

  // What the scene says about itself.
  std::string body_name;    // "boxes"
  std::string ground_name;  // "a terrain of 240 tiles"
  double friction = 0.6;    // Coulomb's coefficient
  double body_size = 1;     // a typical body's extent
  std::function<double(double x, double y)> ground_height;

 private:
  struct StoredMesh {
    Mesh mesh, drawn;
    dTriMeshDataID data;
  };

  void addGeom(dGeomID geom);

  dWorldID ode_;
  dSpaceID space_ = nullptr;
  std::list<StoredMesh> meshes_;
  std::vector<dGeomID> geoms_;
  std::vector<dBodyID> bodies_;
  size_t static_triangles_ = 0;
  size_t body_triangles_ = 0;
};

}  // namespace pile

#endif
