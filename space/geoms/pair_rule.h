// Which two geoms are a pair, by pointer: the last word where boxes cannot decide. Kernels and
// devices test the same on packed bits and bodies (space/base/pair_list.h).
#pragma once

#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "space/geoms/geom_tests.h"

namespace ode_parallel_sap {

// Needs exactMode(): flushed denormals would compare as equal.
inline bool boxesOverlap(const dxGeom* a, const dxGeom* b) {
  const dReal *const p = a->aabb, *const q = b->aabb;
  return p[0] <= q[1] && q[0] <= p[1] && p[2] <= q[3] && q[2] <= p[3] && p[4] <= q[5] &&
         q[4] <= p[5];
}

// The same of boxes that may be so far apart on each axis.
inline bool boxesAreNear(const dxGeom* a, const dxGeom* b, dReal distance) {
  const dReal *const p = a->aabb, *const q = b->aabb;
  return p[0] <= q[1] + distance && q[0] <= p[1] + distance && p[2] <= q[3] + distance &&
         q[2] <= p[3] + distance && p[4] <= q[5] + distance && q[4] <= p[5] + distance;
}

inline bool filtersMatch(const dxGeom* a, const dxGeom* b) {
  return !(a->body && a->body == b->body) &&
         ((a->category_bits & b->collide_bits) || (b->category_bits & a->collide_bits));
}

// Calls both AABBTest functions where one may say no; true if neither rules the pair out.
inline bool passesAABBTests(dxGeom* a, dxGeom* b) {
  return !(hasAABBTest(a) || hasAABBTest(b)) ||
         (a->AABBTest(b, b->aabb) != 0 && b->AABBTest(a, a->aabb) != 0);
}

// A dPlane is solid where normal * x <= distance. The corner of the AABB that is deepest in it
// decides whether the AABB reaches it, but for errors of rounding: those of this sum (three
// products, three sums), of ODE's own when it computed the AABB from pose and size, and of ODE's
// collider when it decides what touches. Each is a few times epsilon times the largest numbers that
// take part, which are bounded by the AABB's own bounds and the distance. 32 times is more than all
// of them together.
constexpr double plane_rounding = 32 * static_cast<double>(std::numeric_limits<dReal>::epsilon());

// The greatest magnitude of the finite ones of two bounds. An infinite one is no result of
// rounding, and gives none to the other.
inline double finiteMagnitude(double lower, double upper) {
  constexpr double most = std::numeric_limits<dReal>::max();
  lower = std::fabs(lower);
  upper = std::fabs(upper);
  return std::max(lower <= most ? lower : 0, upper <= most ? upper : 0);
}

// True only if no point of the AABB, moved by such errors, is in the half-space. False where
// anything is NaN. A half-infinite AABB is clear of the plane if all of it is. Needs exactMode().
inline bool isClearOfPlane(const dReal* aabb, const dReal* plane) {
  double depth = -static_cast<double>(plane[3]), size = std::fabs(static_cast<double>(plane[3]));
  for (int axis = 0; axis < 3; ++axis) {
    const double normal = plane[axis], lower = aabb[2 * axis], upper = aabb[2 * axis + 1];
    if (normal == 0) continue;
    depth += normal * (normal > 0 ? lower : upper);
    size += std::fabs(normal) * finiteMagnitude(lower, upper);
  }
  return depth > plane_rounding * size + std::numeric_limits<double>::min();
}

// Whether one of the geoms is a plane of which the other one's AABB is clear.
__attribute__((noinline)) inline bool areClearByPlane(const dxGeom* a, const dxGeom* b) {
  const auto isClearOf = [](const dxGeom* geom, const dxGeom* of) {
    return of->type == dPlaneClass &&
           isClearOfPlane(geom->aabb, static_cast<const dxPlane*>(of)->p);
  };
  return isClearOf(a, b) || isClearOf(b, a);
}

// What the user sets, and which two geoms are a pair by that and ODE's rules, AABBTest apart.
struct PairRules {
  bool skip_static = false;  // no pairs of geoms without bodies
  bool skip_asleep = false;  // no pairs whose bodies are all disabled
  bool cull_planes = false;  // pairs of planes only with what reaches their half-space
  bool notified = false;     // the program announces silent changes
  bool checked = false;      // each frame checks that it does
  dReal tolerance = 0;       // how far apart boxes of a pair may be

  bool operator==(const PairRules& other) const {
    return skip_static == other.skip_static && skip_asleep == other.skip_asleep &&
           cull_planes == other.cull_planes && notified == other.notified &&
           checked == other.checked && tolerance == other.tolerance;
  }

  // Whether pairs of geoms at rest are no pairs. ODE does not announce it when one comes to rest.
  bool leavesOutResting() const { return skip_static || skip_asleep; }
  // Whether verifyPairs() tests all candidates again, as silent changes are not announced.
  bool verifiesPairs() const { return leavesOutResting() && !notified; }
  // Whether only ODE's filters have a say.
  bool isODEs() const { return !leavesOutResting() && !cull_planes; }

  // Whether pairs of this geom with others of its kind are left out. Spaces are neither static nor
  // asleep: their geoms may have bodies.
  bool isResting(const dxGeom* geom) const {
    if (geom->body) return skip_asleep && !dBodyIsEnabled(geom->body);
    return skip_static && !IS_SPACE(geom);
  }
  // Whether the user has a pair left out: both static, or no body awake and one asleep.
  bool isLeftOut(const dxGeom* a, const dxGeom* b) const {
    if (!leavesOutResting()) return false;
    const bool a_rests = isResting(a), b_rests = isResting(b);
    if (a_rests && b_rests) return true;
    const auto isStatic = [](const dxGeom* geom) { return !geom->body && !IS_SPACE(geom); };
    return skip_asleep && ((a_rests && isStatic(b)) || (b_rests && isStatic(a)));
  }

  // Those that follow need exactMode(), but for the one of silent changes.
  // Whether geoms that take part and whose AABBs overlap are a pair.
  bool mayPair(const dxGeom* a, const dxGeom* b) const { return match(a, b) && !isLeftOut(a, b); }
  // Whether dSpaceCollide2 finds a pair whose AABBs overlap: one at rest, too.
  bool isHit(const dxGeom* own, const dxGeom* geom) const {
    return isEnabled(own) && match(own, geom);
  }
  // Whether a pair found earlier would still be one if it did not rest.
  bool isLeftOutAtRest(const dxGeom* a, const dxGeom* b) const {
    return isLeftOut(a, b) && isEnabled(a) && isEnabled(b) && boxesAreNear(a, b, tolerance) &&
           match(a, b);
  }
  // Whether the geoms of a candidate are still enabled and, if some may rest, match by their bits.
  bool passesSilentChanges(const dxGeom* a, const dxGeom* b) const {
    return isEnabled(a) && isEnabled(b) && (!leavesOutResting() || filtersMatch(a, b));
  }

 private:
  bool match(const dxGeom* a, const dxGeom* b) const {
    return filtersMatch(a, b) && !(cull_planes && areClearByPlane(a, b));
  }
};

}  // namespace ode_parallel_sap
