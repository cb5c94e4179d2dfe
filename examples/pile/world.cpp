#include "world.h"

#include <cstdint>
#include <stdexcept>
#include <utility>

namespace pile {
namespace {

size_t triangleCount(dGeomID geom) {
  if (dGeomGetClass(geom) != dTriMeshClass) return 0;
  return static_cast<size_t>(dGeomTriMeshGetTriangleCount(geom));
}

}  // namespace

World::World() {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  ode_ = dWorldCreate();
  dWorldSetGravity(ode_, 0, 0, static_cast<dReal>(-9.81));
}

World::~World() {
  if (space_) {
    dSpaceDestroy(space_);
  } else {
    for (dGeomID geom : geoms_) dGeomDestroy(geom);
  }
  for (const StoredMesh& stored : meshes_) dGeomTriMeshDataDestroy(stored.data);
  dWorldDestroy(ode_);
  dCloseODE();
}

dTriMeshDataID World::addMesh(Mesh mesh) {
  Mesh drawn = mesh;
  return addMesh(std::move(mesh), std::move(drawn));
}

dTriMeshDataID World::addMesh(Mesh mesh, Mesh drawn) {
  meshes_.push_back({std::move(mesh), std::move(drawn), dGeomTriMeshDataCreate()});
  const StoredMesh& stored = meshes_.back();
  dGeomTriMeshDataBuildSingle(
      stored.data, stored.mesh.points.data(), sizeof(Mesh::Point),
      static_cast<int>(stored.mesh.points.size()), stored.mesh.triangles.data(),
      static_cast<int>(3 * stored.mesh.triangles.size()), sizeof(Mesh::Triangle));
  return stored.data;
}

const Mesh& World::drawnMeshOf(dGeomID geom) const {
  const dTriMeshDataID data = dGeomTriMeshGetTriMeshDataID(geom);
  for (const StoredMesh& stored : meshes_)
    if (stored.data == data) return stored.drawn;
  throw std::out_of_range("a mesh of another world");
}

void World::addGeom(dGeomID geom) {
  dGeomSetData(geom, reinterpret_cast<void*>(static_cast<std::uintptr_t>(geoms_.size())));
  geoms_.push_back(geom);
}

void World::addStatic(dGeomID geom) {
  addGeom(geom);
  static_triangles_ += triangleCount(geom);
}

void World::addBody(dGeomID geom, const dMass& mass, const Pose& pose) {
  addGeom(geom);
  body_triangles_ += triangleCount(geom);
  const dBodyID body = dBodyCreate(ode_);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, static_cast<dReal>(pose.position[0]), static_cast<dReal>(pose.position[1]),
                   static_cast<dReal>(pose.position[2]));
  dBodySetQuaternion(body, pose.rotation);
  dGeomSetBody(geom, body);
  bodies_.push_back(body);
}

void World::useSpace(dSpaceID space) {
  if (space_) {
    dSpaceClean(space_);  // ODE's spaces want all moved geoms before all others
    for (dGeomID geom : geoms_) dSpaceRemove(space_, geom);
    dSpaceDestroy(space_);
  }
  space_ = space;
  for (dGeomID geom : geoms_) dSpaceAdd(space_, geom);
}

State World::state() const {
  State state;
  for (dBodyID body : bodies_) {
    const dReal* p = dBodyGetPosition(body);
    state.mean_height += p[2] / static_cast<double>(bodies_.size());
    if (!(p[2] >= ground_height(p[0], p[1]))) ++state.lost;
    if (!dBodyIsEnabled(body)) ++state.asleep;
  }
  return state;
}

size_t World::indexOf(dGeomID geom) {
  return static_cast<size_t>(reinterpret_cast<std::uintptr_t>(dGeomGetData(geom)));
}

}  // namespace pile
