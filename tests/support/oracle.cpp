#include "oracle.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "user_box.h"

namespace sap_test {
namespace {

// The longest length that this ODE takes for zero: 0, but 1e-6 in Gazebo classic's fork.
dReal longestZero() {
  static const dReal longest = [] {
    const dReal tiny = dReal(1e-6);
    const dSpaceID space = dSimpleSpaceCreate(nullptr);
    dCreateSphere(space, 1);
    dCreateSphere(space, tiny);
    int pairs = 0;
    dSpaceCollide(space, &pairs,
                  [](void* count, dGeomID, dGeomID) { ++*static_cast<int*>(count); });
    dSpaceDestroy(space);
    return pairs > 0 ? dReal(0) : tiny;
  }();
  return longest;
}

bool isZeroSized(dGeomID geom) {
  const dReal zero = longestZero();
  dVector3 lengths;
  dReal radius = 1, length = 1;
  switch (dGeomGetClass(geom)) {
    case dSphereClass:
      return dGeomSphereGetRadius(geom) <= zero;
    case dBoxClass:
      dGeomBoxGetLengths(geom, lengths);
      return std::min({lengths[0], lengths[1], lengths[2]}) <= zero;
    case dCapsuleClass:  // without length it is still a sphere
      dGeomCapsuleGetParams(geom, &radius, &length);
      return radius <= zero;
    case dCylinderClass:
      dGeomCylinderGetParams(geom, &radius, &length);
      return std::min(radius, length) <= zero;
    default:
      return false;
  }
}

bool passesAABBTest(dGeomID self, dGeomID other, Bounds bounds_of_other) {
  if (!isUserBox(self)) return true;
  const Veto veto = userBoxData(self).veto;
  return !veto || veto(self, other, bounds_of_other.data()) != 0;
}

bool bitsMatch(dGeomID a, dGeomID b) {
  return (dGeomGetCategoryBits(a) & dGeomGetCollideBits(b)) ||
         (dGeomGetCategoryBits(b) & dGeomGetCollideBits(a));
}

bool onOneBody(dGeomID a, dGeomID b) {
  return dGeomGetBody(a) && dGeomGetBody(a) == dGeomGetBody(b);
}

bool mayTouchIfNear(dGeomID a, const Bounds& bounds_a, dGeomID b, const Bounds& bounds_b) {
  return bitsMatch(a, b) && !onOneBody(a, b) && passesAABBTest(a, b, bounds_b) &&
         passesAABBTest(b, a, bounds_a);
}

bool mayTouch(dGeomID a, const Bounds& bounds_a, dGeomID b, const Bounds& bounds_b) {
  return overlap(bounds_a, bounds_b) && mayTouchIfNear(a, bounds_a, b, bounds_b);
}

}  // namespace

bool holdsGeom(dGeomID geom) {
  if (!dGeomIsSpace(geom)) return true;
  const dSpaceID space = reinterpret_cast<dSpaceID>(geom);
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i)
    if (holdsGeom(dSpaceGetGeom(space, i))) return true;
  return false;
}

bool isOn(dGeomID geom) {
  return dGeomIsEnabled(geom) && !isZeroSized(geom) && holdsGeom(geom);
}

bool takesPart(dGeomID geom) {
  if (!isOn(geom)) return false;
  const Bounds bounds = boundsOf(geom);
  return std::none_of(bounds.begin(), bounds.end(), [](dReal bound) { return std::isnan(bound); });
}

bool mayTouch(dGeomID first, dGeomID second) {
  return mayTouch(first, boundsOf(first), second, boundsOf(second));
}

bool mayTouchIfNear(dGeomID first, dGeomID second) {
  return mayTouchIfNear(first, boundsOf(first), second, boundsOf(second));
}

std::vector<dGeomID> takingPart(const std::vector<dGeomID>& all, std::vector<Bounds>& bounds) {
  std::vector<dGeomID> geoms;
  std::copy_if(all.begin(), all.end(), std::back_inserter(geoms), takesPart);
  for (const dGeomID geom : geoms) bounds.push_back(boundsOf(geom));
  return geoms;
}

Pairs expectedPairs(const std::vector<dGeomID>& in_add_order) {
  std::vector<Bounds> bounds;
  const std::vector<dGeomID> geoms = takingPart(in_add_order, bounds);
  Pairs pairs;
  for (std::size_t i = 0; i < geoms.size(); ++i) {
    for (std::size_t j = i + 1; j < geoms.size(); ++j) {
      if (overlap(bounds[i], bounds[j]) && mayTouch(geoms[i], bounds[i], geoms[j], bounds[j])) {
        pairs.emplace_back(number(geoms[i]), number(geoms[j]));
      }
    }
  }
  return pairs;
}

Pairs expectedPairs(const Boxes& boxes) {
  Pairs pairs;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = i + 1; j < boxes.size(); ++j) {
      const Box &a = boxes[i], &b = boxes[j];
      if (a.low[0] <= b.high[0] && b.low[0] <= a.high[0] && a.low[1] <= b.high[1] &&
          b.low[1] <= a.high[1] && a.low[2] <= b.high[2] && b.low[2] <= a.high[2]) {
        pairs.emplace_back(i, j);
      }
    }
  }
  return pairs;
}

}  // namespace sap_test
