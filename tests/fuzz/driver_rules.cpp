// Spaces that are told to leave pairs out, or to let some more through: skip static, skip asleep,
// cull planes, tolerance. Which pairs they owe, which they may report, and which they must not.
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>

#include "../support/oracle.h"
#include "driver.h"

namespace sap_test {
namespace {

bool isStatic(dGeomID geom) {
  return !dGeomGetBody(geom) && !dGeomIsSpace(geom);
}

bool isAsleep(dGeomID geom) {
  return dGeomGetBody(geom) && !dBodyIsEnabled(dGeomGetBody(geom));
}

// How far apart on the axis on which they are furthest; 0 or less if they overlap.
long double gapOf(const Bounds& a, const Bounds& b) {
  long double gap = -std::numeric_limits<long double>::infinity();
  for (int i = 0; i < 6; i += 2) {
    // Not by differences: infinities overlap themselves.
    if (a[i] > b[i + 1]) gap = std::max(gap, static_cast<long double>(a[i]) - b[i + 1]);
    if (b[i] > a[i + 1]) gap = std::max(gap, static_cast<long double>(b[i]) - a[i + 1]);
  }
  return gap;
}

// The distance from the plane of the corner that is nearest to it, over the largest finite number
// that takes part (of an inverted box the corner that would be); negative where the box reaches the
// plane or is infinite on its side.
long double relativeClearance(const Bounds& box, const dVector4 plane) {
  long double distance = -static_cast<long double>(plane[3]);
  long double largest = std::fabs(distance);
  for (int axis = 0; axis < 3; ++axis) {
    if (plane[axis] == 0) continue;
    const long double normal = plane[axis];
    const long double low = box[2 * axis], high = box[2 * axis + 1];
    const long double nearest = normal * (normal > 0 ? low : high);
    if (std::isinf(nearest) && nearest < 0) return -1;
    distance += nearest;
    for (const long double bound : {low, high})
      if (!std::isinf(bound)) largest = std::max(largest, std::fabs(normal * bound));
  }
  if (distance <= 0) return -1;
  // Near the ends of the type's range nobody can be sure.
  constexpr long double most = std::numeric_limits<dReal>::max() / 16, least = 1 / most;
  if (largest > most || distance < least) return least;
  return std::isinf(distance) ? 1 : distance / largest;
}

}  // namespace

bool Driver::Rules::any() const {
  return skip_static || skip_asleep || cull_planes || tolerance > 0;
}

Driver::Owed Driver::owedByPlanes(const Rules& rules, int first, int second) const {
  if (!rules.cull_planes) return Owed::must;
  for (const bool swapped : {false, true}) {
    const Object &a = objects_[swapped ? second : first], &b = objects_[swapped ? first : second];
    if (a.kind != kPlane || b.kind == kPlane) continue;
    dVector4 plane;
    dGeomPlaneGetParams(a.geom, plane);
    Bounds bounds;
    dGeomGetAABB(b.geom, bounds.data());
    const long double clearance = relativeClearance(bounds, plane);
    // The header names 32 epsilon, and leaves open how the largest coordinate is found.
    if (clearance > 1000 * std::numeric_limits<dReal>::epsilon()) return Owed::must_not;
    if (clearance > 0) return Owed::may;
  }
  return Owed::must;
}

Driver::Owed Driver::owed(const Rules& rules, int first, int second, long double gap) const {
  const dGeomID a = objects_[first].geom, b = objects_[second].geom;
  const bool a_static = isStatic(a), b_static = isStatic(b);
  const bool a_asleep = isAsleep(a), b_asleep = isAsleep(b);
  if (rules.skip_static && a_static && b_static) return Owed::must_not;
  if (rules.skip_asleep && (a_asleep || b_asleep) && (a_asleep || a_static) &&
      (b_asleep || b_static)) {
    return Owed::must_not;
  }
  if (!mayTouchIfNear(a, b)) return Owed::must_not;
  const Owed by_planes = owedByPlanes(rules, first, second);
  if (by_planes == Owed::must && gap > 0) return Owed::may;
  // A plane that a box is clear of by less than the tolerance is none that it is clear of.
  return by_planes == Owed::must_not && rules.tolerance > 0 ? Owed::may : by_planes;
}

void Driver::compareByRules(int space, const Pairs& got, bool beginning_only) {
  const Rules& rules = objects_[space].rules;
  std::vector<int> members;
  std::vector<Bounds> bounds;
  for (const int member : objects_[space].members) {
    if (!takesPart(objects_[member].geom)) continue;
    members.push_back(member);
    bounds.emplace_back();
    dGeomGetAABB(objects_[member].geom, bounds.back().data());
  }
  // The sum that makes a box wider may round up.
  const long double most =
      rules.tolerance * (1 + 4 * static_cast<long double>(std::numeric_limits<dReal>::epsilon()));
  std::size_t next = 0;
  for (std::size_t i = 0; i < members.size(); ++i) {
    for (std::size_t j = i + 1; j < members.size(); ++j) {
      const bool reported = next < got.size() && got[next].first == std::size_t(members[i]) &&
                            got[next].second == std::size_t(members[j]);
      const long double gap = gapOf(bounds[i], bounds[j]);
      const Owed due = gap > most ? Owed::must_not : owed(rules, members[i], members[j], gap);
      if (reported && due == Owed::must_not) {
        return failPair(space, "extra", members[i], members[j]);
      }
      if (!reported && due == Owed::must) {
        return failPair(space, "missed", members[i], members[j]);
      }
      next += reported;
      if (beginning_only && next == got.size()) return;
    }
  }
  if (next == got.size()) return;
  failPair(space, "repeated or out of order", static_cast<int>(got[next].first),
           static_cast<int>(got[next].second));
}

void Driver::failPair(int space, const char* what, int a, int b) {
  const Rules& rules = objects_[space].rules;
  std::ostringstream text;
  text << "space " << space << " (skip static " << rules.skip_static << ", skip asleep "
       << rules.skip_asleep << ", cull planes " << rules.cull_planes << ", tolerance "
       << rules.tolerance << "): " << what << std::setprecision(17);
  for (const int geom : {a, b}) {
    const Object& o = objects_[geom];
    text << "\n  " << geom << " of kind " << o.kind << ", body " << o.body << ":";
    Bounds of_it;
    dGeomGetAABB(o.geom, of_it.data());
    for (const dReal bound : of_it) text << " " << bound;
  }
  fail(text.str());
}

// Of the pairs owed by dSpaceCollide2, those that a space that culls planes owes all the same, or
// did report.
Pairs Driver::withoutCulled(int space, const Pairs& expected, const Pairs& got) const {
  const Rules& rules = objects_[space].rules;
  if (!rules.cull_planes) return expected;
  const Pairs reported = sorted(got);
  Pairs left;
  for (const Pair& pair : expected) {
    const Owed due =
        owedByPlanes(rules, static_cast<int>(pair.first), static_cast<int>(pair.second));
    if (due == Owed::must_not) continue;
    if (due == Owed::may && !std::binary_search(reported.begin(), reported.end(), pair)) continue;
    left.push_back(pair);
  }
  return left;
}

}  // namespace sap_test
