#include "collider_threads.h"

#include <algorithm>

namespace ode_parallel_sap {

namespace {

// Thread-local caches for the colliders of meshes: OPCODE's, not those of GIMPACT, whose meshes
// carry work data that a collision locks and updates.
bool meshesMayShareCores() {
  static const bool may = dCheckConfiguration("ODE_EXT_mt_collisions") != 0 &&
                          dCheckConfiguration("ODE_EXT_gimpact") == 0;
  return may;
}

// A mesh's own callbacks are the user's code, and its temporal coherence is a list in the mesh to
// which each collision adds.
bool runsUserCode(dxGeom* mesh) {
  return dGeomTriMeshGetCallback(mesh) || dGeomTriMeshGetArrayCallback(mesh) ||
         dGeomTriMeshGetRayCallback(mesh) || dGeomTriMeshGetTriMergeCallback(mesh);
}

bool remembersCollisions(dxGeom* mesh) {
  return dGeomTriMeshIsTCEnabled(mesh, dSphereClass) || dGeomTriMeshIsTCEnabled(mesh, dBoxClass) ||
         dGeomTriMeshIsTCEnabled(mesh, dCapsuleClass);
}

ColliderUse useOf(dxGeom* geom) {
  // dCollide would write the pose of an offset geom; a space has brought it up to date, but a pair
  // may come from elsewhere.
  if (geom->gflags & GEOM_POSR_BAD) return ColliderUse::CallingThread;
  switch (geom->type) {
    case dSphereClass:
    case dBoxClass:
    case dCapsuleClass:
    case dPlaneClass:
    case dRayClass:
      return ColliderUse::Light;
    case dCylinderClass:
    case dConvexClass:
      return ColliderUse::Heavy;
    case dTriMeshClass:
      return meshesMayShareCores() && !runsUserCode(geom) && !remembersCollisions(geom)
                 ? ColliderUse::Heavy
                 : ColliderUse::CallingThread;
    // A heightfield keeps its triangles in buffers of its own and moves the other geom, with its
    // body, into its frame for a while. A geom transform does so with the geom that it holds.
    // Classes of the user's: nobody knows.
    default:
      return ColliderUse::CallingThread;
  }
}

}  // namespace

ColliderUse colliderUse(dxGeom* a, dxGeom* b) {
  return std::max(useOf(a), useOf(b));
}

}  // namespace ode_parallel_sap
