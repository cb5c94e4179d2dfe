#include "space/contacts/collider_threads.h"

#include <mutex>
#include <new>

#include "space/base/platform.h"
#include "space/geoms/geom_tests.h"

namespace ode_parallel_sap {

namespace {

// The colliders of meshes share one cache, unless each thread has its own.
bool meshesShareACache() {
  static const bool share = dCheckConfiguration("ODE_EXT_mt_collisions") == 0;
  return share;
}

// To which each collision adds.
bool remembersCollisions(dxGeom* mesh) {
  return dGeomTriMeshIsTCEnabled(mesh, dSphereClass) || dGeomTriMeshIsTCEnabled(mesh, dBoxClass) ||
         dGeomTriMeshIsTCEnabled(mesh, dCapsuleClass);
}

// ODE's collider of a geom transform moves what that carries for a while.
bool needsTurn(dxGeom* a, dxGeom* b) {
  bool any = false;
  for (dxGeom* const geom : {a, b}) {
    dxGeom* const shape = carriedBy(geom);
    any = any || shape != geom;
    if (!shape || shape->type != dTriMeshClass) continue;
    if (runsUserCode(shape)) return false;
    any = any || meshesShareACache() || !meshesAreRead() || remembersCollisions(shape);
  }
  return any;
}

// Whose turn it is. Recursive: an override of a collider may collide other geoms. A child process
// has none of the other threads, so none forks while one of them is in a collider.
std::recursive_mutex& turn() {
  static std::recursive_mutex* const lock = [] {
    onFork([] { turn().lock(); }, [] { turn().unlock(); },
           [] { new (&turn()) std::recursive_mutex; });
    return new std::recursive_mutex;  // never destroyed: threads may be at work at a program's end
  }();
  return *lock;
}

enum class Shape {
  Primitive,
  Plane,
  Solid,  // iterates until it is close enough
  Mesh,
  Heightfield,
  Other
};

Shape shapeOf(dxGeom* geom) {
  // dCollide would write the pose of an offset geom. A pair may come from outside of a space.
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
      return meshesAreRead() && !runsUserCode(geom) && !remembersCollisions(geom) ? Shape::Mesh
                                                                                  : Shape::Other;
    case dHeightfieldClass:
      return Shape::Heightfield;
    // A geom transform moves the geom that it holds for a while. User classes may do anything.
    default:
      return Shape::Other;
  }
}

}  // namespace

bool runsUserCode(dxGeom* mesh) {
  return dGeomTriMeshGetCallback(mesh) || dGeomTriMeshGetArrayCallback(mesh) ||
         dGeomTriMeshGetRayCallback(mesh) || dGeomTriMeshGetTriMergeCallback(mesh);
}

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
dxGeom* carriedBy(dxGeom* geom) {
  while (geom && geom->type == dGeomTransformClass) geom = dGeomTransformGetGeom(geom);
  return geom;
}
#pragma GCC diagnostic pop

ColliderUse colliderUse(dxGeom* a, dxGeom* b) {
  const Shape p = shapeOf(a), q = shapeOf(b);
  const auto either = [=](Shape shape) { return p == shape || q == shape; };
  if (either(Shape::Other)) return ColliderUse::CallingThread;
  // A thread's own collider has another cache for meshes, but only one.
  if (either(Shape::Heightfield))
    return either(Shape::Mesh) && !meshesShareACache() ? ColliderUse::CallingThread
                                                       : ColliderUse::OwnCollider;
  if (either(Shape::Mesh) && meshesShareACache()) return ColliderUse::OwnCollider;
  if (either(Shape::Solid)) return ColliderUse::Heavy;
  // A primitive meets a few triangles of a mesh; a plane all, and another mesh perhaps many.
  if (either(Shape::Mesh) && !either(Shape::Primitive)) return ColliderUse::Heavy;
  return ColliderUse::Light;
}

int collideInTurn(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip) {
  const auto collide = ode_collide.load(std::memory_order_relaxed);
  if (!needsTurn(a, b)) return collide(a, b, flags, contacts, skip);
  const std::lock_guard<std::recursive_mutex> own_turn(turn());
  return collide(a, b, flags, contacts, skip);
}

}  // namespace ode_parallel_sap
