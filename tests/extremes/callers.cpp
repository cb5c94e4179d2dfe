// What the program around a space does to it: callbacks that throw or collide again, other
// floating-point modes than the usual.
#include <algorithm>

#include "../support/floating_point.h"
#include "extreme.h"

namespace sap_test {
namespace {

void anywhere(Scene& scene, dGeomID geom, int) {
  scene.placeAnywhere(geom);
}

// The callback throws at its 1st, 2nd, 4th... call; a geom comes and goes in between, which takes a
// space that is not locked. What was seen before the throw must be how the whole begins; if not,
// the whole is spoilt by what came instead.
Pairs collideThrowing(Scene& scene) {
  std::vector<Pairs> beginnings;
  for (std::size_t at = 1; at < 100000; at = at < 4 ? at * 2 : at * 5) {
    beginnings.push_back(collideUntil(scene.space(), at));
    if (beginnings.back().size() < at) break;
    const dGeomID passing = dCreateSphere(scene.space(), 1);
    dGeomDestroy(passing);
  }
  Pairs whole = sap_test::collide(scene.space());
  for (const Pairs& beginning : beginnings) {
    if (beginning.size() <= whole.size() &&
        std::equal(beginning.begin(), beginning.end(), whole.begin()))
      continue;
    whole.insert(whole.begin(), beginning.begin(), beginning.end());
    break;
  }
  return whole;
}

struct CollidingCallback {
  dSpaceID space;
  Pairs pairs;
  Pairs inner;

  static void call(void* data, dGeomID a, dGeomID b) {
    CollidingCallback& self = *static_cast<CollidingCallback*>(data);
    record(&self.pairs, a, b);
    if (self.pairs.size() % 500 == 1) self.inner = sap_test::collide(self.space);
    if (self.pairs.size() % 700 == 1) sap_test::collide2(self.space, a);
  }
};

Pairs collideWithin(Scene& scene) {
  CollidingCallback callback{scene.space(), {}, {}};
  dSpaceCollide(scene.space(), &callback, CollidingCallback::call);
  if (callback.pairs.empty() || callback.inner == callback.pairs) return callback.pairs;
  Pairs spoilt = callback.pairs;
  spoilt.insert(spoilt.end(), callback.inner.begin(), callback.inner.end());
  return spoilt;
}

// Whatever the callback disables counts in the next frame only; by then it is enabled again.
Pairs collideDisabling(Scene& scene) {
  Pairs pairs;
  dSpaceCollide(scene.space(), &pairs, [](void* data, dGeomID a, dGeomID b) {
    record(data, a, b);
    dGeomDisable(b);
  });
  for (const dGeomID geom : scene.geoms()) dGeomEnable(geom);
  return pairs;
}

// User boxes only: ODE's own computations of bounds are the program's matter in any mode.
// Gaps and overlaps of some denormals among ordinary boxes.
void denormalGaps(Scene& scene, int frame) {
  for (std::size_t i = 0; i < scene.size; ++i) {
    Bounds bounds;
    for (int axis = 0; axis < 3; ++axis) {
      const dReal at = real(scene.random.below(12)) - 6;
      const dReal length = real(scene.random.below(4));
      bounds[2 * axis] = at * kDenormal;
      bounds[2 * axis + 1] = (at + length) * kDenormal;
      if (scene.random.chance(0.2)) bounds[2 * axis] = -1;
      if (scene.random.chance(0.2)) bounds[2 * axis + 1] = 1;
    }
    if (frame == 0 || scene.random.chance(0.3)) scene.setUserBox(i, bounds);
  }
}

// Bounds whose narrowing to float or whose differences overflow, infinite and NaN ones.
void trappingBounds(Scene& scene, int frame) {
  const dReal values[] = {-kInfinity, -kLargest,    -kLargest / 2, -1,        -kDenormal, 0,
                          1,          kLargest / 2, kLargest,      kInfinity, kDenormal};
  for (std::size_t i = 0; i < scene.size; ++i) {
    Bounds bounds;
    for (int axis = 0; axis < 3; ++axis) {
      bounds[2 * axis] = scene.between(0, scene.side());
      bounds[2 * axis + 1] = bounds[2 * axis] + 1;
      if (!scene.random.chance(0.1)) continue;
      bounds[2 * axis] = values[scene.random.below(11)];
      bounds[2 * axis + 1] = values[scene.random.below(11)];
    }
    if (scene.random.chance(0.02)) bounds[scene.random.below(6)] = kNaN;
    if (frame == 0 || scene.random.chance(0.3)) scene.setUserBox(i, bounds);
  }
}

}  // namespace

Extremes extremeCallers() {
  const Play unit_boxes = eachUnitBox(anywhere);
  Extremes all = {
      {"a callback that throws at every k-th call", unit_boxes, 5000, 3, collideThrowing},
      {"a callback that collides its own space", unit_boxes, 5000, 3, collideWithin},
      {"a callback that disables all geoms", unit_boxes, 5000, 3, collideDisabling},
  };
  if (!FloatingPointMode::kCanBeSet) return all;
  const auto add = [&](const char* name, auto play, std::size_t most, unsigned mode) {
    all.push_back({name, play, most});
    all.back().mode = mode;
  };
  add("denormals flushed (-ffast-math)", denormalGaps, 700, FloatingPointMode::kFlushing);
  add("rounding downward", unit_boxes, 5000, FloatingPointMode::kDownward);
  add("rounding upward", unit_boxes, 5000, FloatingPointMode::kUpward);
  add("rounding toward zero", unit_boxes, 5000, FloatingPointMode::kTowardZero);
  add("invalid operations and overflows trap", trappingBounds, 1500, FloatingPointMode::kTrapping);
  return all;
}

}  // namespace sap_test
