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

// A new body with the mass, the pose and the velocity of another one.
dBodyID copyOf(dBodyID other, dWorldID world) {
  const dBodyID body = dBodyCreate(world);
  dMass mass;
  dBodyGetMass(other, &mass);
  dBodySetMass(body, &mass);
  const dReal* place = dBodyGetPosition(other);
  dBodySetPosition(body, place[0], place[1], place[2]);
  dBodySetQuaternion(body, dBodyGetQuaternion(other));
  const dReal* speed = dBodyGetLinearVel(other);
  dBodySetLinearVel(body, speed[0], speed[1], speed[2]);
  const dReal* rotation = dBodyGetAngularVel(other);
  dBodySetAngularVel(body, rotation[0], rotation[1], rotation[2]);
  if (!dBodyIsEnabled(other)) dBodyDisable(body);
  return body;
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
  meshes_.push_back({std::move(mesh), dGeomTriMeshDataCreate()});
  const StoredMesh& stored = meshes_.back();
  dGeomTriMeshDataBuildSingle(
      stored.data, stored.mesh.points.data(), sizeof(Mesh::Point),
      static_cast<int>(stored.mesh.points.size()), stored.mesh.triangles.data(),
      static_cast<int>(3 * stored.mesh.triangles.size()), sizeof(Mesh::Triangle));
  return stored.data;
}

const Mesh& World::meshOf(dGeomID geom) const {
  const dTriMeshDataID data = dGeomTriMeshGetTriMeshDataID(geom);
  for (const StoredMesh& stored : meshes_)
    if (stored.data == data) return stored.mesh;
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
  dMass scaled = mass;
  if (density != 1) dMassAdjust(&scaled, static_cast<dReal>(density) * mass.mass);
  dBodySetMass(body, &scaled);
  dBodySetPosition(body, static_cast<dReal>(pose.position[0]), static_cast<dReal>(pose.position[1]),
                   static_cast<dReal>(pose.position[2]));
  dBodySetQuaternion(body, pose.rotation);
  dGeomSetBody(geom, body);
  bodies_.push_back(body);
}

void World::shuffleBodies(Random& random) {
  std::vector<dGeomID> geoms, others;
  for (dGeomID geom : geoms_) (dGeomGetBody(geom) ? geoms : others).push_back(geom);
  for (size_t i = geoms.size(); i > 1; --i)
    std::swap(geoms[i - 1], geoms[static_cast<size_t>(random.uniform(0, static_cast<double>(i)))]);
  geoms_.clear();
  for (dGeomID geom : others) addGeom(geom);
  std::vector<dBodyID> bodies;
  for (dGeomID geom : geoms) {
    addGeom(geom);
    bodies.push_back(copyOf(dGeomGetBody(geom), ode_));
    dGeomSetBody(geom, bodies.back());
  }
  for (dBodyID body : bodies_) dBodyDestroy(body);
  bodies_ = std::move(bodies);
}

void World::useSpace(dSpaceID space) {
  if (space_) {
    for (dGeomID geom : geoms_) dSpaceRemove(space_, geom);
    dSpaceDestroy(space_);
  }
  space_ = space;
  for (dGeomID geom : geoms_) dSpaceAdd(space_, geom);
}

size_t World::indexOf(dGeomID geom) {
  return static_cast<size_t>(reinterpret_cast<std::uintptr_t>(dGeomGetData(geom)));
}

}  // namespace pile
