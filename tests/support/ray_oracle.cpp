#include "ray_oracle.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "oracle.h"
#include "recorder.h"

namespace sap_test {
namespace {

constexpr int kNumberBits = 0xffff;

// Stably by distance, NaN last.
bool isNearer(const dParallelSAPRayHit& a, const dParallelSAPRayHit& b) {
  if (std::isnan(a.distance) || std::isnan(b.distance))
    return !std::isnan(a.distance) && std::isnan(b.distance);
  return a.distance < b.distance;
}

// Of heightfields, whose collider makes contacts of rays that are below all ground.
bool isOffRay(dGeomID ray, const dContactGeom& contact) {
  constexpr dReal extents = 8;  // of every heightfield in the tests, both together
  dVector3 from, along;
  dGeomRayGet(ray, from, along);
  dReal off = 0, size = std::fabs(contact.depth) + extents;
  for (int axis = 0; axis < 3; ++axis) {
    off = std::max(off, std::fabs(contact.pos[axis] - from[axis] - contact.depth * along[axis]));
    size += std::fabs(from[axis]) + std::fabs(contact.pos[axis]);
  }
  return off > size * std::sqrt(std::numeric_limits<dReal>::epsilon());
}

dGeomID carriedBy(dGeomID geom) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  return dGeomGetClass(geom) == dGeomTransformClass ? dGeomTransformGetGeom(geom) : geom;
#pragma GCC diagnostic pop
}

// Of all contacts that dCollide finds, the nearest ones: as many as the flags say.
void collectHits(dGeomID ray, dGeomID geom, int flags, bool nearest,
                 const std::function<bool(dGeomID)>& passes, RayHits& hits) {
  if (!takesPart(geom) || !mayTouch(geom, ray)) return;
  if (dGeomIsSpace(geom)) {
    const dSpaceID space = reinterpret_cast<dSpaceID>(geom);
    for (int i = 0; i < dSpaceGetNumGeoms(space); ++i)
      collectHits(ray, dSpaceGetGeom(space, i), flags, nearest, passes, hits);
    return;
  }
  if (passes(geom)) return;
  const int shape = dGeomGetClass(carriedBy(geom));
  dGeomRaySetClosestHit(
      ray, (flags & dParallelSAPRayClosestHit) ||
               (nearest && !(shape == dTriMeshClass && dGeomTriMeshGetCallback(carriedBy(geom)))));
  static std::vector<dContactGeom> found(kNumberBits);
  const int count = dCollide(ray, geom, kNumberBits, found.data(), sizeof(dContactGeom));
  RayHits own;
  for (int i = 0; i < count; ++i) {
    const dContactGeom& contact = found[static_cast<std::size_t>(i)];
    if (shape == dHeightfieldClass && isOffRay(ray, contact)) continue;
    dParallelSAPRayHit hit = {};
    hit.geom = geom;
    hit.distance = contact.depth;
    std::copy_n(contact.pos, 3, hit.pos);
    std::copy_n(contact.normal, 3, hit.normal);
    hit.side = contact.side2;
    own.push_back(hit);
  }
  std::stable_sort(own.begin(), own.end(), isNearer);
  const std::size_t most = nearest ? 1 : static_cast<std::size_t>(std::max(flags & kNumberBits, 1));
  own.resize(std::min(own.size(), most));
  hits.insert(hits.end(), own.begin(), own.end());
}

std::string describe(const dParallelSAPRayHit& hit) {
  if (!hit.geom) return "nothing";
  return "class " + std::to_string(dGeomGetClass(hit.geom)) + " at " + std::to_string(hit.distance);
}

bool isRay(const dParallelSAPRay& ray) {
  bool finite = true, directed = false;
  for (int axis = 0; axis < 3; ++axis) {
    finite = finite && std::isfinite(ray.origin[axis]) && std::isfinite(ray.direction[axis]);
    directed = directed || ray.direction[axis] != 0;
  }
  return finite && directed && ray.length >= 0;
}

// All hits of each ray, or the nearest of each geom, the nearest first.
std::vector<RayHits> expectedHits(const std::vector<dGeomID>& in_add_order, const Rays& rays,
                                  int flags, bool nearest, const Filter& filter) {
  std::vector<RayHits> all;
  const dGeomID ray = dCreateRay(nullptr, 1);
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"  // the one that forks have, too
  dGeomRaySetParams(ray, (flags & dParallelSAPRayFirstContact) != 0,
                    (flags & dParallelSAPRayBackfaceCull) != 0);
#pragma GCC diagnostic pop
  for (const dParallelSAPRay& asked : rays) {
    const auto passes = [&, i = all.size()](dGeomID geom) {
      return (asked.ignore && dGeomGetBody(geom) == asked.ignore) || (filter && !filter(i, geom));
    };
    all.emplace_back();
    if (!isRay(asked)) continue;
    dGeomRaySet(ray, asked.origin[0], asked.origin[1], asked.origin[2], asked.direction[0],
                asked.direction[1], asked.direction[2]);
    dGeomRaySetLength(ray, asked.length);
    const bool all_bits = asked.category_bits == 0 && asked.collide_bits == 0;
    dGeomSetCategoryBits(ray, all_bits ? ~0ul : asked.category_bits);
    dGeomSetCollideBits(ray, all_bits ? ~0ul : asked.collide_bits);
    if (!takesPart(ray)) continue;
    for (const dGeomID geom : in_add_order)
      collectHits(ray, geom, flags, nearest, passes, all.back());
    std::stable_sort(all.back().begin(), all.back().end(), isNearer);
  }
  dGeomDestroy(ray);
  return all;
}

}  // namespace

bool sameBits(const dParallelSAPRayHit& a, const dParallelSAPRayHit& b) {
  return a.geom == b.geom && a.side == b.side &&
         std::memcmp(&a.distance, &b.distance, sizeof a.distance) == 0 &&
         std::memcmp(a.pos, b.pos, 3 * sizeof(dReal)) == 0 &&
         std::memcmp(a.normal, b.normal, 3 * sizeof(dReal)) == 0;
}

dParallelSAPRay rayOf(const double (&from)[3], const double (&along)[3], double length) {
  dParallelSAPRay ray = {};
  for (int axis = 0; axis < 3; ++axis) {
    ray.origin[axis] = real(from[axis]);
    ray.direction[axis] = real(along[axis]);
  }
  ray.length = real(length);
  ray.category_bits = ray.collide_bits = ~0ul;
  return ray;
}

Rays raysAt(const std::vector<dGeomID>& geoms, std::size_t n, Random& random) {
  Rays rays;
  while (rays.size() < n) {
    dReal bounds[6];
    const dGeomID at = geoms[random.below(geoms.size())];
    dGeomGetAABB(at, bounds);
    double middle[3], half[3], from[3], along[3], distance = 0;
    const double far = std::pow(10, random.between(-1, 6));
    const std::size_t how = random.below(4);
    for (int axis = 0; axis < 3; ++axis) {
      middle[axis] = (static_cast<double>(bounds[2 * axis]) + bounds[2 * axis + 1]) / 2;
      half[axis] = (static_cast<double>(bounds[2 * axis + 1]) - bounds[2 * axis]) / 2;
      if (!std::isfinite(middle[axis])) middle[axis] = random.gauss();
      if (!std::isfinite(half[axis])) half[axis] = 1;
      along[axis] = how == 3 && random.chance(0.5) ? 0 : random.gauss();
    }
    // At the middle, at a corner or a point of the surface, or at a sphere's rim.
    for (int axis = 0; axis < 3; ++axis) {
      const double side = how == 0   ? 0
                          : how == 1 ? (random.chance(0.5) ? 1 : -1)
                                     : random.between(-1, 1);
      from[axis] = middle[axis] + side * half[axis] - far * half[axis] * along[axis];
      distance += std::pow(far * half[axis] * along[axis], 2);
      along[axis] *= half[axis];
    }
    const double length = std::sqrt(distance) * random.between(0.5, 3);
    rays.push_back(rayOf(from, along, random.chance(0.1) ? std::sqrt(distance) : length));
    if (random.chance(0.1)) rays.back().category_bits = random.below(16);
    if (random.chance(0.1)) rays.back().collide_bits = random.below(16);
    // Often of a geom that it would hit.
    if (random.chance(0.3)) rays.back().ignore = dGeomGetBody(at);
  }
  return rays;
}

RayHits nearestHits(dSpaceID space, const Rays& rays, int flags) {
  dParallelSAPRayHit unwritten = {};
  unwritten.side = -77;
  RayHits hits(rays.size(), unwritten);
  const std::size_t count =
      dParallelSAPSpaceRays(space, rays.data(), rays.size(), flags, hits.data());
  const auto isHit = [](const dParallelSAPRayHit& hit) { return hit.geom != nullptr; };
  if (count != static_cast<std::size_t>(std::count_if(hits.begin(), hits.end(), isHit)))
    hits.clear();
  return hits;
}

std::vector<RayHits> allHits(dSpaceID space, const Rays& rays, int flags) {
  std::vector<RayHits> all(rays.size());
  std::size_t next = 0, told = 0;
  bool in_order = true;
  auto take = [&](std::size_t ray, const dParallelSAPRayHit* hits, std::size_t n) {
    in_order = in_order && ray >= next && n > 0;
    next = ray + 1;
    told += n;
    all.at(ray).assign(hits, hits + n);
  };
  const std::size_t count = dParallelSAPSpaceRayHits(space, rays.data(), rays.size(), flags, &take,
                                                     invoke<decltype(take)>);
  if (count != told || !in_order) all.clear();
  return all;
}

RayAnswers answersOf(dSpaceID space, const Rays& rays, int flags) {
  return {nearestHits(space, rays, flags), allHits(space, rays, flags)};
}

RayAnswers owedRays(const std::vector<dGeomID>& in_add_order, const Rays& rays, int flags,
                    const Filter& filter) {
  RayAnswers owed = {{}, expectedHits(in_add_order, rays, flags, false, filter)};
  for (const RayHits& hits :
       expectedHits(in_add_order, rays, flags & ~dParallelSAPRayClosestHit, true, filter))
    owed.nearest.push_back(hits.empty() ? dParallelSAPRayHit{} : hits[0]);
  return owed;
}

std::string difference(const RayAnswers& got, const RayAnswers& owed) {
  const auto& [nearest, all] = got;
  if (nearest.size() != owed.nearest.size() || all.size() != owed.all.size())
    return "another number of hits than there are, or not in their order";
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string name = "ray " + std::to_string(i) + ": ";
    if (!sameBits(nearest[i], owed.nearest[i]))
      return name + describe(nearest[i]) + " instead of " + describe(owed.nearest[i]);
    if (all[i].size() != owed.all[i].size())
      return name + std::to_string(all[i].size()) + " hits instead of " +
             std::to_string(owed.all[i].size());
    for (std::size_t hit = 0; hit < all[i].size(); ++hit)
      if (!sameBits(all[i][hit], owed.all[i][hit]))
        return name + "hit " + std::to_string(hit) + ": " + describe(all[i][hit]) + " instead of " +
               describe(owed.all[i][hit]);
  }
  return "";
}

std::string wrongRays(dSpaceID space, const std::vector<dGeomID>& in_add_order, const Rays& rays,
                      int flags) {
  // The space goes first: the oracle asks geoms for their bounds, after which they are not dirty.
  const RayAnswers first = answersOf(space, rays, flags);
  const RayAnswers owed = owedRays(in_add_order, rays, flags);
  const std::string wrong = difference(first, owed);
  return wrong == "" ? difference(answersOf(space, rays, flags), owed)
                     : "before the oracle: " + wrong;
}

int RayBatch::someFlags() {
  int flags = static_cast<int>(random.below(4));
  if (random.chance(0.3)) flags |= dParallelSAPRayFirstContact;
  if (random.chance(0.3)) flags |= dParallelSAPRayBackfaceCull;
  if (random.chance(0.5)) flags |= dParallelSAPRayClosestHit;
  return flags;
}

std::size_t RayBatch::meeting(const RayAnswers& answers) {
  std::size_t count = 0;
  for (const dParallelSAPRayHit& hit : answers.nearest) count += hit.geom != nullptr;
  return count;
}

void RayBatch::report(dSpaceID space, int flags,
                      const std::function<void(dGeomID)>& callback) const {
  auto take = [&](std::size_t, const dParallelSAPRayHit* hits, std::size_t) {
    callback(hits[0].geom);
  };
  dParallelSAPSpaceRayHits(space, rays.data(), rays.size(), flags, &take, invoke<decltype(take)>);
}

Bounds RayBatch::bounds(std::size_t query) const {
  Bounds bounds;
  const dParallelSAPRay& ray = rays.at(query);
  const dReal norm = std::hypot(ray.direction[0], ray.direction[1], ray.direction[2]);
  for (int axis = 0; axis < 3; ++axis) {
    const dReal from = ray.origin[axis], to = from + ray.direction[axis] / norm * ray.length,
                slack = dReal(1e-3) * (std::fabs(from) + std::fabs(to) + 1);
    bounds[2 * axis] = std::min(from, to) - slack;
    bounds[2 * axis + 1] = std::max(from, to) + slack;
  }
  return bounds;
}

}  // namespace sap_test
