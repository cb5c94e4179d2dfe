#include "space/trace/trace_changes.h"

#include <algorithm>
#include <cstring>
#include <iterator>

namespace ode_parallel_sap {

namespace {

constexpr std::uint32_t none = 0;

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

// Of a geom that is up to date; its number, its parent's and its body's are the caller's.
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

template <class Record>
bool same(const Record& a, const Record& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

}  // namespace

void TraceChanges::write(const Scene& scene, TraceBytes& bytes) {
  ++frame_;
  for (TraceBytes& list : lists_) list.clear();
  present_.swap(present_before_);
  present_.clear();
  for (const dxGeom* const geom : scene.slots)
    if (geom) visit(geom, 0);
  dropUnseen();
  std::sort(present_.begin(), present_.end());
  std::vector<std::uint32_t> gone;
  std::set_difference(present_before_.begin(), present_before_.end(), present_.begin(),
                      present_.end(), std::back_inserter(gone));
  for (const std::uint32_t number : gone) put(lists_[removed], number);
  constexpr std::size_t bounds_entry = 8 + sizeof GeomRecord::bounds;
  constexpr std::size_t entry[lists] = {sizeof gone[0], sizeof(BodyRecord), sizeof(GeomRecord),
                                        bounds_entry + sizeof GeomRecord::pose, bounds_entry};
  for (int list = 0; list < lists; ++list)
    put(bytes, static_cast<std::uint32_t>(lists_[list].size() / entry[list]));
  put(bytes, none);
  pad(lists_[removed]);
  for (const TraceBytes& list : lists_) bytes += list;
}

void TraceChanges::visit(const dxGeom* geom, std::uint32_t parent) {
  Seen<GeomRecord>& known = geoms_[geom];
  known.frame = frame_;
  if (parent == 0 && known.record.traits.parent != 0) known = {{}, frame_};  // it came to the space
  GeomRecord now = recordOf(geom);
  const std::uint32_t last_number = known.record.traits.number;
  now.traits.number = last_number ? last_number : ++last_geom_;
  now.traits.parent = parent;
  now.traits.body = visit(geom->body);
  present_.push_back(now.traits.number);
  compare(now, known.record);
  if (!IS_SPACE(geom)) return;
  for (const dxGeom* own = static_cast<const dxSpace*>(geom)->first; own; own = own->next)
    visit(own, now.traits.number);
}

// Writes a body that is new or has changed; 0 for none.
std::uint32_t TraceChanges::visit(dBodyID body) {
  if (!body) return 0;
  Seen<BodyRecord>& known = bodies_[body];
  if (known.frame == frame_) return known.record.number;
  known.frame = frame_;
  BodyRecord now = recordOf(body);
  now.number = known.record.number ? known.record.number : ++last_body_;
  if (!same(now, known.record)) put(lists_[changed_bodies], now);
  known.record = now;
  return now.number;
}

void TraceChanges::compare(const GeomRecord& now, GeomRecord& last) {
  if (!same(now.traits, last.traits))
    put(lists_[changed_geoms], now);
  else if (!same(now.pose, last.pose))
    put(lists_[poses], now.traits.number, none, now.pose, now.bounds);
  else if (!same(now.bounds, last.bounds))
    put(lists_[bounds], now.traits.number, none, now.bounds);
  last = now;
}

// What is not there any more: another one may come to its address.
void TraceChanges::dropUnseen() {
  const auto drop = [this](auto& map) {
    for (auto entry = map.begin(); entry != map.end();)
      entry = entry->second.frame == frame_ ? std::next(entry) : map.erase(entry);
  };
  drop(geoms_);
  drop(bodies_);
}

}  // namespace ode_parallel_sap
