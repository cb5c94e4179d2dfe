// Everything moves, comes, goes or is on one body; sub-spaces; and programs that have other
// floating-point modes than the usual.
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

void addSubSpace(Scene& scene, dSpaceID space) {
  scene.spaces.push_back(space);
  scene.take(asGeom(space));
}

void deepNest(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    addSubSpace(scene, dParallelSAPSpaceCreate(scene.space()));
    dSpaceID bottom = scene.spaces.back();
    scene.marked.push_back(dCreateBox(bottom, 1, 1, 1));
    for (int level = 1; level < 50; ++level) bottom = dParallelSAPSpaceCreate(bottom);
    scene.marked.push_back(dCreateBox(bottom, 1, 1, 1));
    dGeomSetPosition(scene.marked[0], 1, 1, 1);
    scene.spaces.push_back(bottom);
  }
  scene.placeAnywhere(scene.marked[1]);
  // The spaces above still have to notice.
  if (frame == 2) dSpaceClean(scene.spaces.back());
  if (frame == 3) dGeomSetPosition(scene.marked[1], kInfinity, 1, 1);
}

// Hundreds of sub-spaces of three kinds that fill, empty or stay empty, and a ball that wanders
// through them.
void manySubSpaces(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size / 3);
    for (std::size_t i = 0; i < scene.size / 3; ++i) {
      addSubSpace(scene, i % 3 == 0   ? dParallelSAPSpaceCreate(scene.space())
                         : i % 3 == 1 ? dSimpleSpaceCreate(scene.space())
                                      : dSweepAndPruneSpaceCreate(scene.space(), dSAP_AXES_XYZ));
      scene.marked.push_back(nullptr);
    }
    scene.marked.push_back(dCreateSphere(scene.spaces[0], 4));
  }
  for (std::size_t i = 0; i < scene.spaces.size(); ++i) {
    dGeomID& inside = scene.marked[i];
    if (!scene.random.chance(0.4)) continue;
    if (inside && scene.random.chance(0.5)) {
      dGeomDestroy(inside);
      inside = nullptr;
      continue;
    }
    if (!inside) inside = dCreateBox(scene.spaces[i], 1, 2, 3);
    scene.placeAnywhere(inside);
  }
  const dGeomID wanderer = scene.marked.back();
  dSpaceRemove(dGeomGetSpace(wanderer), wanderer);
  dSpaceAdd(scene.spaces[scene.random.below(scene.spaces.size())], wanderer);
  scene.placeAnywhere(wanderer);
}

void anywhere(Scene& scene, dGeomID geom, int) {
  scene.placeAnywhere(geom);
}

// User boxes only: ODE's own computations of bounds are the program's matter in any mode.
// Gaps and overlaps of some denormals, with some bounds that are none.
Play denormals(double others) {
  return [others](Scene& scene, int frame) {
    for (std::size_t i = 0; i < scene.size; ++i) {
      Bounds bounds;
      for (int axis = 0; axis < 3; ++axis) {
        const dReal low = real(scene.random.below(20)) - 10;
        bounds[2 * axis] = low * kDenormal;
        bounds[2 * axis + 1] = (low + real(scene.random.below(5))) * kDenormal;
        if (scene.random.chance(others)) bounds[2 * axis] = -1;
        if (scene.random.chance(others)) bounds[2 * axis + 1] = 1;
      }
      if (frame == 0 || scene.random.chance(0.4)) scene.setUserBox(i, bounds);
    }
  };
}

// Bounds whose narrowing to float or whose differences overflow, infinite and NaN ones.
void anyBounds(Scene& scene, int frame) {
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
  const Play unit_boxes = eachUnitBox(anywhere);
  Extremes all = {
      {"geoms that cross the world in every frame", eachUnitBox(acrossTheWorld), 1500, 6},
      {"scales from 1e-30 to 1e30 from frame to frame", scaleFromFrameToFrame, 5000, 6},
      {"all geoms removed and added in every frame", onUnitBoxes(reAddAll)},
      {"all geoms destroyed and made anew in every frame", renewAll},
      {"10,000 geoms on one body", onOneBody, 10000, 3},
      {"fifty spaces in each other", deepNest, 5000, 5},
      {"hundreds of sub-spaces of all kinds", manySubSpaces, 1500, 6},
      {"denormal coordinates only", denormals(0), 1500},
      {"bounds of every kind", anyBounds},
  };
  if (!FloatingPointMode::kCanBeSet) return all;
  const auto add = [&](const char* name, auto play, std::size_t most, unsigned mode) {
    all.push_back({name, play, most});
    all.back().mode = mode;
  };
  add("denormals flushed (-ffast-math)", denormals(0.2), 700, FloatingPointMode::kFlushing);
  add("rounding downward", unit_boxes, 5000, FloatingPointMode::kDownward);
  add("rounding upward", unit_boxes, 5000, FloatingPointMode::kUpward);
  add("rounding toward zero", unit_boxes, 5000, FloatingPointMode::kTowardZero);
  add("invalid operations and overflows trap", anyBounds, 1500, FloatingPointMode::kTrapping);
  return all;
}

}  // namespace sap_test
