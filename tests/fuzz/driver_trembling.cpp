// Frames in which nearly everything moves, but stays in its fat box.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <utility>

#include "driver.h"

namespace sap_test {

// Of so many boxes a look at some tells how far all move.
void Driver::fillForTrembling(int space, Random& random) {
  constexpr std::size_t kFewest = 100;
  while (objects_[space].members.size() < kFewest && alive_.size() < most_geoms_) {
    const int leaf = createLeaf(random.chance(0.5) ? kBox : kSphere, random);
    place(leaf, random, 0);
    add(leaf, space);
    ++changes_;
  }
}

// Each geom by up to this share of its least extent along each axis; a part of them far. What has
// no extent stays: it has no room either. So do rays, of which many lie along an axis.
void Driver::trembleAll(int space, double share, double leaving, Random& random) {
  for (const int member : objects_[space].members) {
    if (objects_[member].kind >= kRay) continue;
    const dGeomID geom = objects_[member].geom;
    Bounds bounds;
    dGeomGetAABB(geom, bounds.data());
    double least = 2;
    for (int axis = 0; axis < 3; ++axis)
      least = std::min(least, static_cast<double>(bounds[2 * axis + 1] - bounds[2 * axis]));
    if (!(least > 0)) continue;
    const double distance = random.chance(leaving) ? 0.3 : share * least;
    const dReal* const at = dGeomGetPosition(geom);
    dReal to[3];
    for (int axis = 0; axis < 3; ++axis)
      to[axis] = at[axis] + static_cast<dReal>(random.between(-distance, distance));
    dGeomSetPosition(geom, to[0], to[1], to[2]);
    ++changes_;
  }
}

// Its bits or its body, while it stays in its fat box. Or it moves, comes or goes.
void Driver::changeWhatMayPair(int member, Random& random) {
  Object& o = objects_[member];
  const std::size_t what = random.below(4);
  ++changes_;
  if (what < 2) {
    const unsigned long bits = random.chance(0.5) ? ~0ul : random.below(8);
    (what == 0 ? dGeomSetCategoryBits : dGeomSetCollideBits)(o.geom, bits);
  } else if (what == 2 && o.body == kNone && o.kind < kPlane) {
    const int other = pickMember(o.parent, random);
    if (objects_[other].body == kNone) return;
    dVector3 at;
    dGeomCopyPosition(o.geom, at);
    dGeomSetBody(o.geom, bodies_[objects_[other].body]);
    dGeomSetOffsetWorldPosition(o.geom, at[0], at[1], at[2]);
    o.body = objects_[other].body;
  } else {
    changeForEvents(member, random);
  }
}

// A few leave their fat boxes, come, go or become others in between. By the sweep, so that small
// scenes keep candidates too, and without a tolerance, which has room for boxes itself.
void Driver::collideTrembling() {
  const int space = pickOurSpace();
  const dSpaceID id = spaceOf(space);
  const std::size_t frames = 4 + decisions_.below(8);
  const double shares[] = {0.001, 0.004, 0.012}, parts[] = {0, 0.002, 0.01, 0.05};
  const double share = shares[decisions_.below(std::size(shares))];
  const double leaving = parts[decisions_.below(std::size(parts))];
  const double changing = parts[decisions_.below(std::size(parts) - 1)];
  Random random = decisions_.random();
  fillForTrembling(space, random);
  log(std::to_string(frames) + " frames of " + std::to_string(space) + ", trembling by " +
      std::to_string(share) + ", leaving " + std::to_string(leaving) + ", changing " +
      std::to_string(changing));
  const int method = dParallelSAPSpaceGetMethod(id);
  const dReal tolerance = dParallelSAPSpaceGetTolerance(id);
  dParallelSAPSpaceSetMethod(id, dParallelSAPMethodSweep);
  dParallelSAPSpaceSetTolerance(id, 0);
  for (std::size_t frame = 0; frame < frames && problem_.empty(); ++frame) {
    trembleAll(space, share, leaving, random);
    const std::vector<int> members = objects_[space].members;
    for (const int member : members)
      if (objects_[member].kind != kSpace && random.chance(changing))
        changeWhatMayPair(member, random);
    compare(space, collide(id));
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(id, &stats);
    ++trembling_;
    candidates_kept_ += stats.candidates_kept > 0;
  }
  dParallelSAPSpaceSetMethod(id, method);
  dParallelSAPSpaceSetTolerance(id, tolerance);
}

}  // namespace sap_test
