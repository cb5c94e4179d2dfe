#include "check.h"

#include <algorithm>
#include <cstdint>

#include "world.h"

namespace pile {
namespace {

void proxyAABB(dGeomID proxy, dReal aabb[6]) {
  const dGeomID original = *static_cast<dGeomID*>(dGeomGetClassData(proxy));
  dGeomGetAABB(original, aabb);
}

dColliderFn* noCollider(int) {
  return nullptr;
}

int proxyClass() {
  static const dGeomClass proxy = {sizeof(dGeomID), noCollider, proxyAABB, nullptr, nullptr};
  return dCreateGeomClass(&proxy);
}

// A pair as one number: the lower index in the upper half.
std::uint64_t packed(std::uint64_t a, std::uint64_t b) {
  return std::min(a, b) << 32 | std::max(a, b);
}

std::uint64_t packed(dGeomID a, dGeomID b) {
  return packed(World::indexOf(a), World::indexOf(b));
}

void keepPair(void* data, dGeomID a, dGeomID b) {
  static_cast<std::vector<std::uint64_t>*>(data)->push_back(packed(a, b));
}

std::string describe(std::uint64_t pair) {
  return "(" + std::to_string(pair >> 32) + ", " + std::to_string(pair & 0xffffffff) + ")";
}

}  // namespace

PairCheck::PairCheck(const std::vector<dGeomID>& geoms) : reference_(dHashSpaceCreate(nullptr)) {
  const int proxy_class = proxyClass();
  for (dGeomID geom : geoms) {
    const dGeomID proxy = dCreateGeom(proxy_class);
    *static_cast<dGeomID*>(dGeomGetClassData(proxy)) = geom;
    dGeomSetData(proxy, dGeomGetData(geom));
    // A body tells its geoms that it moved.
    if (const dBodyID body = dGeomGetBody(geom)) dGeomSetBody(proxy, body);
    dSpaceAdd(reference_, proxy);
  }
}

PairCheck::~PairCheck() {
  dSpaceDestroy(reference_);
}

std::optional<std::string> PairCheck::compare(const std::vector<Pair>& pairs, bool ordered) {
  std::vector<std::uint64_t> expected;
  dSpaceCollide(reference_, &expected, keepPair);
  std::sort(expected.begin(), expected.end());

  std::vector<std::uint64_t> found;
  found.reserve(pairs.size());
  for (const Pair& pair : pairs) found.push_back(packed(pair.first, pair.second));
  const std::vector<std::uint64_t> reported = found;
  std::sort(found.begin(), found.end());

  const auto twice = std::adjacent_find(found.begin(), found.end());
  if (twice != found.end()) return "the pair " + describe(*twice) + " is reported twice";
  const auto [wanted, had] =
      std::mismatch(expected.begin(), expected.end(), found.begin(), found.end());
  const bool missing = wanted != expected.end() && (had == found.end() || *wanted < *had);
  if (missing) return "the pair " + describe(*wanted) + " is missing";
  if (had != found.end()) return "the pair " + describe(*had) + " is not one of dHashSpace's";
  if (!ordered) return std::nullopt;

  for (const Pair& pair : pairs)
    if (World::indexOf(pair.first) > World::indexOf(pair.second))
      return "the pair " + describe(packed(pair.first, pair.second)) + " has its later geom first";
  const auto wrong = std::is_sorted_until(reported.begin(), reported.end());
  if (wrong != reported.end()) return "the pair " + describe(*wrong) + " is out of order";
  return std::nullopt;
}

}  // namespace pile
