// Scenes of which a part changes from frame to frame, often without a word to the space.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <vector>

#include "configurations.h"
#include "oracle.h"
#include "random.h"
#include "recorder.h"
#include "scenes.h"

namespace sap_test {

enum Skip { kNothing, kStatic, kAsleep, kBoth };

// Which pairs the settings leave out, in the words of the header.
inline bool leftOut(dGeomID a, dGeomID b, Skip skip) {
  const dBodyID bodies[] = {dGeomGetBody(a), dGeomGetBody(b)};
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) return false;
  if (!bodies[0] && !bodies[1]) return skip == kStatic || skip == kBoth;
  if (skip != kAsleep && skip != kBoth) return false;
  for (const dBodyID body : bodies)
    if (body && dBodyIsEnabled(body)) return false;
  return true;
}

// Boxes of which many have bodies, and that change in every way.
class ChangingScene {
 public:
  ChangingScene(const Configuration& configuration, std::size_t n, std::uint64_t seed)
      : space_(configuration), world_(space_), random_(seed) {
    world_.addBoxes(denseCube(n, seed));
    for (const dGeomID geom : world_.geoms()) {
      order_.push_back(geom);
      if (random_.chance(0.7)) world_.giveBody(geom);
    }
    reach_ = std::cbrt(static_cast<double>(n));
  }

  dSpaceID space() const { return space_; }

  // From now on the space is told of what changes without a word.
  void promise() {
    dParallelSAPSpaceSetNotified(space_, 1);
    telling_ = true;
  }

  // Moves about `part` of the geoms and changes some without a word to the space.
  void change(double part) {
    const std::size_t moves = static_cast<std::size_t>(part * order_.size() + random_.unit());
    for (std::size_t i = 0; i < moves; ++i) move(any());
    if (part == 0 && random_.chance(0.7)) return;
    for (int i = 0; i < 3; ++i) changeSilently(any());
    if (random_.chance(0.3)) reAdd();
    if (random_.chance(0.2)) dSpaceClean(space_);
    if (random_.chance(0.2)) (void)collide2(space_, any());
  }

  Pairs expected(Skip skip) const {
    Pairs pairs;
    for (const Pair& pair : expectedPairs(order_))
      if (!leftOut(world_.geoms()[pair.first], world_.geoms()[pair.second], skip))
        pairs.push_back(pair);
    return pairs;
  }

  // The distance between the boxes of two geoms on the axis on which it is greatest.
  dReal gap(const Pair& pair) const {
    dReal a[6], b[6], gap = 0;
    dGeomGetAABB(world_.geoms()[pair.first], a);
    dGeomGetAABB(world_.geoms()[pair.second], b);
    for (int axis = 0; axis < 3; ++axis)
      gap = std::max({gap, a[2 * axis] - b[2 * axis + 1], b[2 * axis] - a[2 * axis + 1]});
    return gap;
  }
  void drift(double distance) {
    for (const dGeomID geom : order_) shift(geom, distance);
  }
  std::size_t size() const { return order_.size(); }

 private:
  dGeomID any() { return order_[random_.below(order_.size())]; }

  void move(dGeomID geom) {
    if (random_.chance(0.1))
      dGeomSetPosition(geom, random_.between(0, reach_), random_.between(0, reach_),
                       random_.between(0, reach_));
    else
      shift(geom, 0.3);
  }
  void shift(dGeomID geom, double distance) {
    const dReal* const place = dGeomGetPosition(geom);
    const dReal x = place[0], y = place[1], z = place[2];
    dGeomSetPosition(geom, x + random_.between(-distance, distance),
                     y + random_.between(-distance, distance),
                     z + random_.between(-distance, distance));
  }
  void changeSilently(dGeomID geom) {
    const dBodyID body = dGeomGetBody(geom);
    switch (random_.below(7)) {
      case 0:
        dGeomIsEnabled(geom) ? dGeomDisable(geom) : dGeomEnable(geom);
        break;
      case 1:
        dGeomSetCategoryBits(geom, random_.chance(0.5) ? ~0ul : 1ul << random_.below(3));
        break;
      case 2:
        dGeomSetCollideBits(geom, random_.chance(0.5) ? ~0ul : random_.below(8));
        break;
      case 3:
        dGeomSetBody(geom, nullptr);
        break;
      case 4:
        dGeomSetBody(geom, dGeomGetBody(any()));
        break;
      case 5:
        if (body) dBodyDisable(body);
        break;
      case 6:
        if (body) dBodyEnable(body);
        break;
    }
    if (telling_) tell(geom);
  }
  // Of all geoms at times, or of those that any change of this one may have changed.
  void tell(dGeomID geom) {
    if (random_.chance(0.1)) return dParallelSAPSpaceNotify(space_, nullptr);
    dParallelSAPSpaceNotify(space_, geom);
    const dBodyID body = dGeomGetBody(geom);
    for (dGeomID on = body ? dBodyGetFirstGeom(body) : nullptr; on; on = dBodyGetNextGeom(on))
      dParallelSAPSpaceNotify(space_, on);
  }
  void reAdd() {
    const std::size_t i = random_.below(order_.size());
    const dGeomID geom = order_[i];
    dSpaceRemove(space_, geom);
    if (random_.chance(0.5)) (void)collide(space_);
    dSpaceAdd(space_, geom);
    order_.erase(order_.begin() + i);
    order_.push_back(geom);
  }

  Space space_;
  World world_;
  Random random_;
  std::vector<dGeomID> order_;
  double reach_;
  bool telling_ = false;
};

}  // namespace sap_test
