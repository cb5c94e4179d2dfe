#include "narrow_phase.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace pile {
namespace {

// A mesh of 20,000 triangles lying on a plane has hundreds of points below it. ODE's collider
// returns the first ones in the order of the mesh, so a short list would all be at one end.
constexpr int most_found_at_plane = 1024;
// ODE hashes the contacts of two meshes into 256 buckets of 4; well below that none overflows.
constexpr int most_found_elsewhere = 128;

// How far apart (squared metres) two contacts count whose normals are at right angles.
constexpr double normal_weight = 0.25;

bool isAwake(dGeomID geom) {
  const dBodyID body = dGeomGetBody(geom);
  return body && dBodyIsEnabled(body);
}

bool isPlane(dGeomID geom) {
  return dGeomGetClass(geom) == dPlaneClass;
}

double separation(const dContactGeom& a, const dContactGeom& b) {
  double distance = 0;
  double cosine = 0;
  for (int i = 0; i < 3; ++i) {
    const double step = a.pos[i] - b.pos[i];
    distance += step * step;
    cosine += static_cast<double>(a.normal[i]) * b.normal[i];
  }
  return distance + normal_weight * (1 - cosine);
}

}  // namespace

NarrowPhase::NarrowPhase(int contacts_per_pair, Reducer reducer)
    : most_(static_cast<size_t>(contacts_per_pair)),
      reducer_(reducer),
      found_(most_found_at_plane) {}

int NarrowPhase::keep(dContactGeom* contacts, int count) const {
  switch (reducer_) {
    case Reducer::Deepest:
      return dParallelSAPKeepDeepest(contacts, count, static_cast<int>(most_));
    case Reducer::Spread:
      return dParallelSAPKeepSpread(contacts, count, static_cast<int>(most_));
    case Reducer::Farthest:
      break;
  }
  return static_cast<int>(reduceContacts(contacts, static_cast<size_t>(count), most_));
}

void NarrowPhase::run(const std::vector<Pair>& pairs, std::vector<dContactGeom>& contacts) {
  contacts.clear();
  for (const Pair& pair : pairs) {
    const int flags = flagsOf(this, pair.first, pair.second);
    if (!flags) continue;
    const int count = dCollide(pair.first, pair.second, flags, found_.data(), sizeof(dContactGeom));
    contacts.insert(contacts.end(), found_.data(), found_.data() + keep(found_.data(), count));
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
  return static_cast<const NarrowPhase*>(phase)->keep(contacts, count);
}

void NarrowPhase::append(void* phase, dGeomID, dGeomID, const dContactGeom* contacts, int count) {
  std::vector<dContactGeom>& all = *static_cast<const NarrowPhase*>(phase)->contacts_;
  all.insert(all.end(), contacts, contacts + count);
}

size_t reduceContacts(dContactGeom* contacts, size_t count, size_t most) {
  if (count <= most) return count;
  const auto shallower = [](const dContactGeom& a, const dContactGeom& b) {
    return a.depth < b.depth;
  };
  std::iter_swap(contacts, std::max_element(contacts, contacts + count, shallower));
  std::vector<double> apart(count, std::numeric_limits<double>::infinity());
  for (size_t kept = 1; kept < most; ++kept) {
    size_t farthest = kept;
    for (size_t i = kept; i < count; ++i) {
      apart[i] = std::min(apart[i], separation(contacts[i], contacts[kept - 1]));
      if (apart[i] > apart[farthest]) farthest = i;
    }
    std::swap(contacts[kept], contacts[farthest]);
    std::swap(apart[kept], apart[farthest]);
  }
  return most;
}

}  // namespace pile
