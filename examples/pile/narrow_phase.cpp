#include "narrow_phase.h"

namespace pile {
namespace {

// A mesh of 20,000 triangles lying on a plane has hundreds of points below it. ODE's collider
// returns the first ones in the order of the mesh, so a short list would all be at one end.
constexpr int most_found_at_plane = 1024;
// ODE hashes the contacts of two meshes into 256 buckets of 4; well below that none overflows.
constexpr int most_found_elsewhere = 128;

bool isAwake(dGeomID geom) {
  const dBodyID body = dGeomGetBody(geom);
  return body && dBodyIsEnabled(body);
}

bool isPlane(dGeomID geom) {
  return dGeomGetClass(geom) == dPlaneClass;
}

}  // namespace

NarrowPhase::NarrowPhase(int contacts_per_pair)
    : most_(contacts_per_pair), found_(most_found_at_plane) {}

void NarrowPhase::run(const std::vector<Pair>& pairs, std::vector<dContactGeom>& contacts) {
  contacts.clear();
  for (const Pair& pair : pairs) {
    const int flags = flagsOf(this, pair.first, pair.second);
    if (!flags) continue;
    const int count = dCollide(pair.first, pair.second, flags, found_.data(), sizeof(dContactGeom));
    contacts.insert(contacts.end(), found_.data(),
                    found_.data() + dParallelSAPKeepSpread(found_.data(), count, most_));
  }
}

void NarrowPhase::run(dSpaceID space, std::vector<dContactGeom>& contacts) {
  contacts.clear();
  contacts_ = &contacts;
  const dParallelSAPContactCallbacks callbacks = {append, flagsOf, reduce, nullptr};
  dParallelSAPSpaceCollideContacts(space, this, 0, &callbacks);
}

int NarrowPhase::flagsOf(void*, dGeomID first, dGeomID second) {
  if (!isAwake(first) && !isAwake(second)) return 0;
  return isPlane(first) || isPlane(second) ? most_found_at_plane : most_found_elsewhere;
}

int NarrowPhase::reduce(void* phase, dGeomID, dGeomID, dContactGeom* contacts, int count) {
  return dParallelSAPKeepSpread(contacts, count, static_cast<const NarrowPhase*>(phase)->most_);
}

void NarrowPhase::append(void* phase, dGeomID, dGeomID, const dContactGeom* contacts, int count) {
  std::vector<dContactGeom>& all = *static_cast<const NarrowPhase*>(phase)->contacts_;
  all.insert(all.end(), contacts, contacts + count);
}

}  // namespace pile
