#include "space/trace/geom_record.h"

namespace ode_parallel_sap {

namespace {

// Three rows of three: ODE's have a fourth number, which says nothing.
void copyPose(const dReal* position, const dReal* rotation, dReal (&pose)[trace_format::pose]) {
  for (int i = 0; i < 3; ++i) pose[i] = position[i];
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      pose[3 + 3 * row + column] = rotation[4 * row + column];
}

// Forks of ODE have other functions for these.
int rayFlags(const dxGeom* ray) {
  return (ray->gflags & RAY_FIRSTCONTACT ? 1 : 0) | (ray->gflags & RAY_BACKFACECULL ? 2 : 0) |
         (ray->gflags & RAY_CLOSEST_HIT ? 4 : 0);
}

// The numbers that make a shape, of the classes that can be made again.
void copyParams(dGeomID geom, dReal (&params)[trace_format::params]) {
  switch (geom->type) {
    case dSphereClass:
      params[0] = dGeomSphereGetRadius(geom);
      break;
    case dBoxClass:
      dGeomBoxGetLengths(geom, params);
      params[3] = 0;
      break;
    case dCapsuleClass:
      dGeomCapsuleGetParams(geom, params, params + 1);
      break;
    case dCylinderClass:
      dGeomCylinderGetParams(geom, params, params + 1);
      break;
    case dPlaneClass:
      dGeomPlaneGetParams(geom, params);
      break;
    case dRayClass:
      params[0] = dGeomRayGetLength(geom);
      params[1] = static_cast<dReal>(rayFlags(geom));
      break;
    default:
      break;
  }
}

std::uint32_t flagsOf(const dxGeom* geom) {
  std::uint32_t flags = 0;
  if (geom->gflags & GEOM_ENABLED) flags |= trace_format::enabled;
  if (geom->gflags & GEOM_ZERO_SIZED) flags |= trace_format::zero_sized;
  if (geom->gflags & GEOM_PLACEABLE) flags |= trace_format::placeable;
  if (geom->offset_posr) flags |= trace_format::offset;
  if (IS_SPACE(geom)) flags |= trace_format::space;
  return flags;
}

}  // namespace

bool GeomRecord::Traits::operator==(const Traits& other) const {
  return number == other.number && parent == other.parent && geom_class == other.geom_class &&
         flags == other.flags && body == other.body && category_bits == other.category_bits &&
         collide_bits == other.collide_bits && sameReals(params, other.params);
}

void GeomRecord::put(TraceBytes& bytes) const {
  bytes.put32(traits.number);
  bytes.put32(traits.parent);
  bytes.put32(traits.geom_class);
  bytes.put32(traits.flags);
  bytes.put32(traits.body);
  bytes.put32(0);
  bytes.put64(traits.category_bits);
  bytes.put64(traits.collide_bits);
  bytes.putReals(traits.params, trace_format::params);
  bytes.putReals(pose, trace_format::pose);
  bytes.putReals(bounds, trace_format::bounds);
}

bool BodyRecord::operator==(const BodyRecord& other) const {
  return number == other.number && flags == other.flags && sameReals(pose, other.pose);
}

void BodyRecord::put(TraceBytes& bytes) const {
  bytes.put32(number);
  bytes.put32(flags);
  bytes.putReals(pose, trace_format::pose);
}

GeomRecord recordOf(const dxGeom* geom) {
  GeomRecord record = {};
  record.traits.geom_class = static_cast<std::uint32_t>(geom->type);
  record.traits.flags = flagsOf(geom);
  record.traits.category_bits = geom->category_bits;
  record.traits.collide_bits = geom->collide_bits;
  copyParams(const_cast<dGeomID>(geom), record.traits.params);
  // That of a geom without an offset, on a body, is the body's.
  if (geom->offset_posr)
    copyPose(geom->offset_posr->pos, geom->offset_posr->R, record.pose);
  else if ((geom->gflags & GEOM_PLACEABLE) && !geom->body)
    copyPose(geom->final_posr->pos, geom->final_posr->R, record.pose);
  for (int i = 0; i < trace_format::bounds; ++i) record.bounds[i] = geom->aabb[i];
  return record;
}

BodyRecord recordOf(dBodyID body) {
  BodyRecord record = {};
  record.flags = (dBodyIsEnabled(body) ? trace_format::awake : 0u) |
                 (dBodyIsKinematic(body) ? trace_format::kinematic : 0u);
  copyPose(dBodyGetPosition(body), dBodyGetRotation(body), record.pose);
  return record;
}

}  // namespace ode_parallel_sap
