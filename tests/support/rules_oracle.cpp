#include "rules_oracle.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>

#include "bounds.h"
#include "oracle.h"

namespace sap_test {
namespace {

enum class Owed { must, may, must_not };

bool isStatic(dGeomID geom) {
  return !dGeomGetBody(geom) && !dGeomIsSpace(geom);
}

bool isAsleep(dGeomID geom) {
  return dGeomGetBody(geom) && !dBodyIsEnabled(dGeomGetBody(geom));
}

// Whether they are apart by no more than this on any axis.
bool near(const Bounds& a, const Bounds& b, long double most) {
  for (std::size_t i = 0; i < 6; i += 2) {
    // Not by differences alone: infinities overlap themselves.
    if (a[i] > b[i + 1] && static_cast<long double>(a[i]) - b[i + 1] > most) return false;
    if (b[i] > a[i + 1] && static_cast<long double>(b[i]) - a[i + 1] > most) return false;
  }
  return true;
}

// By the definition in the public header, with eleven bits more than a double: the deepest corner
// is in the half-space, or further from it than ten times what the header calls rounding, or
// between. A tolerance widens the boxes.
Owed owedByPlane(dGeomID plane_geom, dGeomID other, long double tolerance) {
  dVector4 plane;
  dGeomPlaneGetParams(plane_geom, plane);
  const Bounds bounds = boundsOf(other);
  long double depth = -static_cast<long double>(plane[3]), size = std::fabs(plane[3]);
  bool infinitely_far = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const long double normal = plane[axis];
    if (normal == 0) continue;
    const long double lower = bounds[2 * axis], upper = bounds[2 * axis + 1];
    const long double nearest = normal > 0 ? lower : upper;
    if (std::isinf(nearest) && (nearest > 0) != (normal > 0)) return Owed::must;
    infinitely_far = infinitely_far || std::isinf(nearest);
    depth += normal * nearest;
    for (const long double bound : {lower, upper})
      if (!std::isinf(bound)) size += std::fabs(normal) * std::fabs(bound);
  }
  // Sums may be infinite in dReal.
  if (size > std::numeric_limits<dReal>::max() / 4) return Owed::may;
  if (infinitely_far) return Owed::must_not;
  const long double epsilon = std::numeric_limits<dReal>::epsilon();
  if (depth <= 0.01L * epsilon * size) return Owed::must;
  return depth > 2 * tolerance + 320 * epsilon * size + 1e-300L ? Owed::must_not : Owed::may;
}

Owed owedByPlanes(dGeomID a, dGeomID b, dReal tolerance = 0) {
  const bool plane_a = dGeomGetClass(a) == dPlaneClass, plane_b = dGeomGetClass(b) == dPlaneClass;
  if (plane_a == plane_b) return Owed::must;
  return plane_a ? owedByPlane(a, b, tolerance) : owedByPlane(b, a, tolerance);
}

// The sum that makes a box wider may round up.
long double reachOf(const Rules& rules) {
  return rules.tolerance *
         (1 + 4 * static_cast<long double>(std::numeric_limits<dReal>::epsilon()));
}

bool isLeftOut(const Rules& rules, dGeomID a, dGeomID b) {
  const bool rests_a = isStatic(a) || isAsleep(a), rests_b = isStatic(b) || isAsleep(b);
  return (rules.skip_static && isStatic(a) && isStatic(b)) ||
         (rules.skip_asleep && rests_a && rests_b && (isAsleep(a) || isAsleep(b)));
}

Owed owed(const Rules& rules, dGeomID a, dGeomID b, bool overlapping) {
  if (isLeftOut(rules, a, b)) return Owed::must_not;
  if (!mayTouchIfNear(a, b)) return Owed::must_not;
  const Owed by_planes = rules.cull_planes ? owedByPlanes(a, b, rules.tolerance) : Owed::must;
  return by_planes == Owed::must && !overlapping ? Owed::may : by_planes;
}

std::string wrongPair(const Rules& rules, const char* what, dGeomID a, dGeomID b) {
  std::ostringstream text;
  text << what << " (skip static " << rules.skip_static << ", skip asleep " << rules.skip_asleep
       << ", cull planes " << rules.cull_planes << ", tolerance " << rules.tolerance << ")"
       << std::setprecision(17);
  for (const dGeomID geom : {a, b}) {
    text << "\n  " << number(geom) << " of class " << dGeomGetClass(geom) << ":";
    for (const dReal bound : boundsOf(geom)) text << " " << bound;
  }
  return text.str();
}

}  // namespace

Rules Rules::of(dSpaceID space) {
  if (!dSpaceIsParallelSAP(space)) return {};
  return {dParallelSAPSpaceGetSkipStatic(space) != 0, dParallelSAPSpaceGetSkipAsleep(space) != 0,
          dParallelSAPSpaceGetCullPlanes(space) != 0, dParallelSAPSpaceGetTolerance(space)};
}

std::string wrongByRules(const Rules& rules, const std::vector<dGeomID>& in_add_order,
                         const Pairs& got) {
  std::vector<Bounds> bounds;
  const std::vector<dGeomID> geoms = takingPart(in_add_order, bounds);
  const long double most = reachOf(rules);
  std::size_t next = 0;
  for (std::size_t i = 0; i < geoms.size(); ++i) {
    for (std::size_t j = i + 1; j < geoms.size(); ++j) {
      const bool reported =
          next < got.size() && got[next] == Pair(number(geoms[i]), number(geoms[j]));
      const Owed due = near(bounds[i], bounds[j], most)
                           ? owed(rules, geoms[i], geoms[j], overlap(bounds[i], bounds[j]))
                           : Owed::must_not;
      if (reported && due == Owed::must_not) return wrongPair(rules, "extra", geoms[i], geoms[j]);
      if (!reported && due == Owed::must) return wrongPair(rules, "missed", geoms[i], geoms[j]);
      next += reported;
    }
  }
  if (next == got.size()) return "";
  return "repeated or out of order: pair " + std::to_string(next) + " (" +
         std::to_string(got[next].first) + "," + std::to_string(got[next].second) + ")";
}

Rest restOf(const Rules& rules, dGeomID a, dGeomID b) {
  if (!isLeftOut(rules, a, b) || !takesPart(a) || !takesPart(b) || !mayTouchIfNear(a, b) ||
      !near(boundsOf(a), boundsOf(b), reachOf(rules)))
    return Rest::no;
  const Owed by_planes = rules.cull_planes ? owedByPlanes(a, b, rules.tolerance) : Owed::must;
  return by_planes == Owed::must ? Rest::yes : by_planes == Owed::may ? Rest::either : Rest::no;
}

std::string wrongCounts(dSpaceID space, const std::vector<dGeomID>& all, std::size_t pairs) {
  dParallelSAPStats stats = {};
  dParallelSAPSpaceGetStats(space, &stats);
  std::size_t disabled = 0, invalid = 0, unbounded = 0, unsure = 0;
  for (const dGeomID geom : all) {
    // The header lets a geom without body that is disabled or enabled be counted later.
    unsure += dParallelSAPSpaceGetSkipStatic(space) && isStatic(geom);
    const Bounds bounds = boundsOf(geom);
    disabled += !isOn(geom);
    invalid += isOn(geom) && !takesPart(geom);
    bool open = false;
    for (std::size_t i = 0; i < 6; i += 2)
      open =
          open || std::isinf(bounds[i]) || std::isinf(bounds[i + 1]) || bounds[i] > bounds[i + 1];
    unbounded += takesPart(geom) && open;
  }
  std::ostringstream text;
  const auto compare = [&](const char* what, unsigned long long got, std::size_t owed,
                           std::size_t most_off = 0) {
    if (got + most_off < owed || got > owed + most_off)
      text << what << " " << got << " instead of " << owed << "; ";
  };
  compare("geoms", stats.geoms, all.size());
  compare("disabled", stats.disabled, disabled, unsure);
  compare("invalid", stats.invalid, invalid, unsure);
  compare("unbounded", stats.unbounded, unbounded, unsure);
  compare("pairs", stats.pairs, pairs);
  // Each pair was found in this frame or kept.
  if (stats.candidates + stats.kept < pairs)
    text << "candidates " << stats.candidates << " and kept " << stats.kept << " of " << pairs;
  return text.str();
}

Pairs withoutCulled(const Pairs& all, const Pairs& got,
                    const std::function<dGeomID(std::size_t)>& geomOf) {
  const Pairs reported = sorted(got);
  Pairs left;
  for (const Pair& pair : all) {
    const Owed due = owedByPlanes(geomOf(pair.first), geomOf(pair.second));
    if (due == Owed::must ||
        (due == Owed::may && std::binary_search(reported.begin(), reported.end(), pair)))
      left.push_back(pair);
  }
  return left;
}

}  // namespace sap_test
