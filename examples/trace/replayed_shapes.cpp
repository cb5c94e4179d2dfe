#include "replayed_shapes.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace trace {

namespace {

dReal realOf(double value) {
  return static_cast<dReal>(value);
}

// Numbers of a class that are lengths; -1 if its shape is not in a trace.
int lengthsOf(std::uint32_t geom_class) {
  switch (geom_class) {
    case dSphereClass:
    case dRayClass:
      return 1;
    case dCapsuleClass:
    case dCylinderClass:
      return 2;
    case dBoxClass:
      return 3;
    case dPlaneClass:
      return 0;
    default:
      return -1;
  }
}

struct OwnBounds {
  dReal bounds[format::bounds];
};

void tellBounds(dGeomID geom, dReal bounds[6]) {
  const auto* const own = static_cast<const OwnBounds*>(dGeomGetClassData(geom));
  std::copy(std::begin(own->bounds), std::end(own->bounds), bounds);
}

dColliderFn* noCollider(int) {
  return nullptr;
}

int boundsClass() {
  static const int number = [] {
    dGeomClass description = {};
    description.bytes = sizeof(OwnBounds);
    description.collider = noCollider;
    description.aabb = tellBounds;
    return dCreateGeomClass(&description);
  }();
  return number;
}

void copyRotation(const Pose& pose, dMatrix3 rotation) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      rotation[4 * row + column] = realOf(pose[static_cast<std::size_t>(3 + 3 * row + column)]);
    rotation[4 * row + 3] = 0;
  }
}

void setRay(dGeomID ray, const Geom& record) {
  const int flags = static_cast<int>(record.params[1]);
  dGeomRaySetLength(ray, realOf(record.params[0]));
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"  // the one that forks have, too
  dGeomRaySetParams(ray, flags & 1, flags >> 1 & 1);
#pragma GCC diagnostic pop
  dGeomRaySetClosestHit(ray, flags >> 2 & 1);
}

}  // namespace

// With sizes that ODE takes.
bool hasSize(const Geom& record) {
  const int lengths = lengthsOf(record.geom_class);
  for (int i = 0; i < lengths; ++i)
    if (!(record.params[static_cast<std::size_t>(i)] >= 0)) return false;
  if (record.geom_class == dRayClass && !(record.params[1] >= 0 && record.params[1] <= 7))
    return false;
  return lengths >= 0;
}

dGeomID makeShape(int kind, const Geom& record) {
  dGeomID geom = nullptr;
  switch (kind) {
    case a_space:
      return reinterpret_cast<dGeomID>(dSimpleSpaceCreate(nullptr));
    case dSphereClass:
      geom = dCreateSphere(nullptr, 1);
      break;
    case dBoxClass:
      geom = dCreateBox(nullptr, 1, 1, 1);
      break;
    case dCapsuleClass:
      geom = dCreateCapsule(nullptr, 1, 1);
      break;
    case dCylinderClass:
      geom = dCreateCylinder(nullptr, 1, 1);
      break;
    case dPlaneClass:
      geom = dCreatePlane(nullptr, 0, 0, 1, 0);
      break;
    case dRayClass:
      geom = dCreateRay(nullptr, 1);
      break;
    default:
      return dCreateGeom(boundsClass());
  }
  resizeShape(geom, kind, record);
  return geom;
}

void resizeShape(dGeomID geom, int kind, const Geom& record) {
  dReal size[format::params];
  for (std::size_t i = 0; i < format::params; ++i) size[i] = realOf(record.params[i]);
  switch (kind) {
    case dSphereClass:
      return dGeomSphereSetRadius(geom, size[0]);
    case dBoxClass:
      return dGeomBoxSetLengths(geom, size[0], size[1], size[2]);
    case dCapsuleClass:
      return dGeomCapsuleSetParams(geom, size[0], size[1]);
    case dCylinderClass:
      return dGeomCylinderSetParams(geom, size[0], size[1]);
    case dPlaneClass:
      return dGeomPlaneSetParams(geom, size[0], size[1], size[2], size[3]);
    case dRayClass:
      return setRay(geom, record);
    default:
      return;
  }
}

void setBounds(dGeomID geom, const Bounds& bounds) {
  auto* const own = static_cast<OwnBounds*>(dGeomGetClassData(geom));
  for (std::size_t i = 0; i < bounds.size(); ++i) own->bounds[i] = realOf(bounds[i]);
}

bool isPlaceable(int kind) {
  return kind != a_space && kind != dPlaneClass;
}

bool hasWrittenBounds(dGeomID geom, const Bounds& bounds) {
  dReal own[format::bounds];
  dGeomGetAABB(geom, own);
  for (std::size_t i = 0; i < bounds.size(); ++i)
    if (double(own[i]) != bounds[i] && !(std::isnan(own[i]) && std::isnan(bounds[i]))) return false;
  return true;
}

// dBodyGetRotation leads to the body's own matrix, which it may have taken from anywhere.
void setBodyPose(dBodyID body, const Pose& pose) {
  copyRotation(pose, const_cast<dReal*>(dBodyGetRotation(body)));
  dBodySetPosition(body, realOf(pose[0]), realOf(pose[1]), realOf(pose[2]));
}

void setGeomPose(dGeomID geom, const Pose& pose) {
  dMatrix3 rotation;
  copyRotation(pose, rotation);
  dGeomSetRotation(geom, rotation);
  dGeomSetPosition(geom, realOf(pose[0]), realOf(pose[1]), realOf(pose[2]));
}

void setOffset(dGeomID geom, const Pose& pose) {
  dMatrix3 rotation;
  copyRotation(pose, rotation);
  dGeomSetOffsetRotation(geom, rotation);
  dGeomSetOffsetPosition(geom, realOf(pose[0]), realOf(pose[1]), realOf(pose[2]));
}

}  // namespace trace
