// Everything moves, comes, goes, changes its body or its bits; sub-spaces; and programs whose
// callbacks throw or collide again, or that have other floating-point modes than the usual.
#include <algorithm>

#include "../support/floating_point.h"
#include "extreme.h"

namespace sap_test {
namespace {

void acrossTheWorld(Scene& scene, dGeomID geom, int frame) {
  const double reach[] = {1, 1e3, 1e9, 1e25, 2, 1e6};
  const dReal x = scene.between(-1, 1) * real(reach[frame]);
  const dReal y = scene.between(-2, 2);
  scene.place(geom, x, y, scene.between(-2, 2));
}

// Bodies so fast that each time step takes them through the whole world.
void fastBodies(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    for (const dGeomID geom : scene.geoms()) scene.giveBody(geom);
  }
  for (const dBodyID body : scene.bodies()) {
    const dReal* const at = dBodyGetPosition(body);
    dReal velocity[3];
    for (int axis = 0; axis < 3; ++axis) {
      velocity[axis] = 100 * (scene.between(0, scene.side()) - at[axis]);
    }
    dBodySetLinearVel(body, velocity[0], velocity[1], velocity[2]);
    const dReal spin = scene.between(-1e3, 1e3);
    dBodySetAngularVel(body, spin, -spin, spin);
  }
  dWorldSetQuickStepNumIterations(scene.dynamics(), 1);
  dWorldQuickStep(scene.dynamics(), dReal(0.01));
}

void scaleFromFrameToFrame(Scene& scene, int frame) {
  const double scale[] = {1, 1e-30, 1e30, 1e-6, 1e12, 1};
  for (std::size_t i = 0; i < scene.size; ++i) {
    Bounds bounds;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = scene.random.between(0, scene.side());
      bounds[2 * axis] = real(low * scale[frame]);
      bounds[2 * axis + 1] = real((low + 1) * scale[frame]);
    }
    scene.setUserBox(i, bounds);
  }
}

void reAddAll(Scene& scene, int frame) {
  const std::vector<dGeomID> before = scene.geoms();
  for (std::size_t i = 0; i < before.size(); ++i) {
    scene.remove(before[frame % 2 ? before.size() - 1 - i : i]);
  }
  for (const dGeomID geom : before) scene.addAgain(geom);
}

void renewAll(Scene& scene, int) {
  scene.shrinkTo(0);
  scene.addUnitBoxes(scene.size);
}

// All on one body: no pair but with the few that are not. `loose` geoms stay without a body.
void onOneBody(Scene& scene, int frame) {
  constexpr std::size_t loose = 10;
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    scene.giveBody(scene.geoms()[loose]);
    for (std::size_t i = loose + 1; i < scene.size; ++i) {
      dGeomSetBody(scene.geoms()[i], scene.bodies()[0]);
      const dReal x = scene.between(0, scene.side()), y = scene.between(0, scene.side());
      dGeomSetOffsetPosition(scene.geoms()[i], x, y, scene.between(0, scene.side()));
    }
  }
  const dReal x = scene.between(-2, 2);
  dBodySetPosition(scene.bodies()[0], x, 0, 0);
}

// One bit each, of all that an unsigned long has, others in every frame.
void singleBits(Scene& scene, dGeomID geom, int) {
  constexpr std::size_t bits = 8 * sizeof(unsigned long);
  dGeomSetCategoryBits(geom, 1ul << scene.random.below(bits));
  dGeomSetCollideBits(
      geom, scene.random.chance(0.5) ? 1ul << scene.random.below(bits) : scene.random.bits());
}

// A sub-space of the kind under test with a box in it, which scene.marked holds.
void addSubSpace(Scene& scene) {
  const dSpaceID sub_space = scene.make_space(scene.space());
  scene.spaces.push_back(sub_space);
  scene.take(asGeom(sub_space));
  scene.marked.push_back(dCreateBox(sub_space, 1, 1, 1));
  scene.placeAnywhere(scene.marked.back());
}

void deepNest(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    addSubSpace(scene);
    dSpaceID bottom = scene.spaces.back();
    for (int level = 1; level < 50; ++level) bottom = scene.make_space(bottom);
    scene.marked.push_back(dCreateBox(bottom, 1, 1, 1));
    dGeomSetPosition(scene.marked[0], 1, 1, 1);
    scene.spaces.push_back(bottom);
  }
  scene.placeAnywhere(scene.marked[1]);
  // The spaces above still have to notice.
  if (frame == 2) dSpaceClean(scene.spaces.back());
  if (frame == 3) dGeomSetPosition(scene.marked[1], kInfinity, 1, 1);
}

void emptySubSpaces(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size / 2);
    for (std::size_t i = 0; i < scene.size / 2; ++i) {
      scene.take(asGeom(scene.make_space(scene.space())));
    }
  }
  scene.place(scene.geoms()[0], 0, 0, 0);
}

void spacesFillAndEmpty(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size / 2);
    for (std::size_t i = 0; i < scene.size / 8; ++i) addSubSpace(scene);
    return;
  }
  for (std::size_t i = 0; i < scene.spaces.size(); ++i) {
    dGeomID& inside = scene.marked[i];
    if (!scene.random.chance(0.5)) continue;
    if (inside) {
      dGeomDestroy(inside);
      inside = nullptr;
    } else {
      inside = dCreateSphere(scene.spaces[i], 1);
      scene.placeAnywhere(inside);
    }
  }
}

void spacesOfOne(Scene& scene, int frame) {
  if (frame == 0) {
    for (std::size_t i = 0; i < scene.size; ++i) addSubSpace(scene);
  }
  for (const dGeomID geom : scene.marked) {
    if (scene.random.chance(0.3)) scene.placeAnywhere(geom);
  }
}

// A geom that wanders through the sub-spaces, which takes each of their boxes along.
void wanderingGeom(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size / 2);
    for (int i = 0; i < 5; ++i) addSubSpace(scene);
    scene.marked.push_back(dCreateSphere(scene.spaces[0], 4));
    scene.placeAnywhere(scene.marked.back());
    return;
  }
  const dGeomID wanderer = scene.marked.back();
  dSpaceRemove(dGeomGetSpace(wanderer), wanderer);
  dSpaceAdd(scene.spaces[static_cast<std::size_t>(frame) % 5], wanderer);
}

// Sub-spaces of stock kinds in the space under test.
void stockSubSpaces(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    for (int i = 0; i < 20; ++i) {
      const dSpaceID sub_space = i % 2 ? dSimpleSpaceCreate(scene.space())
                                       : dSweepAndPruneSpaceCreate(scene.space(), dSAP_AXES_XYZ);
      scene.take(asGeom(sub_space));
      scene.marked.push_back(dCreateBox(sub_space, 1, 2, 3));
    }
  }
  for (const dGeomID geom : scene.marked) {
    if (scene.random.chance(0.6)) scene.placeAnywhere(geom);
  }
}

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

Extremes extremeChanges() {
  return {
      {"geoms that cross the world in every frame", eachUnitBox(acrossTheWorld), 1500, 6},
      {"bodies that cross the world in every time step", fastBodies, 1500, 6},
      {"scales from 1e-30 to 1e30 from frame to frame", scaleFromFrameToFrame, 5000, 6},
      {"all geoms removed and added in every frame", onUnitBoxes(reAddAll)},
      {"all geoms destroyed and made anew in every frame", renewAll},
      {"10,000 geoms on one body", onOneBody, 10000, 3},
      {"single bits of all that a long has", eachUnitBox(singleBits), 5000, 4},
  };
}

Extremes extremeStructures() {
  return {
      {"fifty spaces in each other", deepNest, 5000, 5},
      {"empty sub-spaces", emptySubSpaces, 1500, 3},
      {"sub-spaces that fill and empty", spacesFillAndEmpty, 1500, 5},
      {"nothing but sub-spaces of one geom", spacesOfOne, 1500},
      {"a geom that wanders through sub-spaces", wanderingGeom, 1500, 6},
      {"sub-spaces of other kinds", stockSubSpaces, 1500},
  };
}

Extremes extremeCallers() {
  const Play unit_boxes = eachUnitBox(anywhere);
  Extremes all = {
      {"a callback that throws at every k-th call", unit_boxes, 5000, 3, collideThrowing},
      {"a callback that collides its own space", unit_boxes, 5000, 3, collideWithin},
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
