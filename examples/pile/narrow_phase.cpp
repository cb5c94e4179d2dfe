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

NarrowPhase::NarrowPhase(int contacts_per_pair)
    : most_(static_cast<size_t>(contacts_per_pair)), found_(most_found_at_plane) {}

void NarrowPhase::run(const std::vector<Pair>& pairs, std::vector<dContactGeom>& contacts) {
  contacts.clear();
  for (const Pair& pair : pairs) {
    if (!isAwake(pair.first) && !isAwake(pair.second)) continue;
    const bool plane = isPlane(pair.first) || isPlane(pair.second);
    const int room = plane ? most_found_at_plane : most_found_elsewhere;
    const int count = dCollide(pair.first, pair.second, room, found_.data(), sizeof(dContactGeom));
    const size_t found = static_cast<size_t>(count);
    reduceContacts(found_, found, most_);
    contacts.insert(contacts.end(), found_.begin(),
                    found_.begin() + static_cast<std::ptrdiff_t>(std::min(found, most_)));
  }
}

void reduceContacts(std::vector<dContactGeom>& contacts, size_t count, size_t most) {
  if (count <= most) return;
  const auto begin = contacts.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  const auto shallower = [](const dContactGeom& a, const dContactGeom& b) {
    return a.depth < b.depth;
  };
  std::iter_swap(begin, std::max_element(begin, end, shallower));
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
}

}  // namespace pile
