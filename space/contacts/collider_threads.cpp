#include "space/contacts/collider_threads.h"

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

enum class Shape {
  Primitive,
  Plane,
  Solid,  // iterates until it is close enough
  Mesh,
  Other
};

Shape shapeOf(dxGeom* geom) {
  // dCollide would write the pose of an offset geom; a space has brought it up to date, but a pair
  // may come from elsewhere.
  if (geom->gflags & GEOM_POSR_BAD) return Shape::Other;
  switch (geom->type) {
    case dSphereClass:
    case dBoxClass:
    case dCapsuleClass:
    case dRayClass:
      return Shape::Primitive;
    case dPlaneClass:
      return Shape::Plane;
    case dCylinderClass:
    case dConvexClass:
      return Shape::Solid;
    case dTriMeshClass:
      return meshesMayShareCores() && !runsUserCode(geom) && !remembersCollisions(geom)
                 ? Shape::Mesh
                 : Shape::Other;
    // A heightfield keeps its triangles in buffers of its own and moves the other geom, with its
    // body, into its frame for a while. A geom transform does so with the geom that it holds.
    // Classes of the user's: nobody knows.
    default:
      return Shape::Other;
  }
}

}  // namespace

ColliderUse colliderUse(dxGeom* a, dxGeom* b) {
  const Shape p = shapeOf(a), q = shapeOf(b);
  const auto either = [=](Shape shape) { return p == shape || q == shape; };
  if (either(Shape::Other)) return ColliderUse::CallingThread;
  if (either(Shape::Solid)) return ColliderUse::Heavy;
  // A primitive meets a few triangles of a mesh; a plane all, and another mesh perhaps many.
  if (either(Shape::Mesh) && !either(Shape::Primitive)) return ColliderUse::Heavy;
  return ColliderUse::Light;
}

}  // namespace ode_parallel_sap
