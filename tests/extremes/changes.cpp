// Everything moves, comes, goes, changes its body or its bits in every frame.
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

void crowdAndScatter(Scene& scene, int frame) {
  for (std::size_t i = 0; i < scene.size; ++i) {
    if (frame % 2) {
      scene.place(scene.geoms()[i], real(i % 20) * 5, 0, 0);
    } else {
      scene.placeAnywhere(scene.geoms()[i]);
    }
  }
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

void oneMoves(Scene& scene, int frame) {
  if (frame % 3) scene.placeAnywhere(scene.anyGeom());
}

void reAddAll(Scene& scene, int frame) {
  const std::vector<dGeomID> before = scene.geoms();
  for (std::size_t i = 0; i < before.size(); ++i) {
    scene.remove(before[frame % 2 ? before.size() - 1 - i : i]);
  }
  for (const dGeomID geom : before) scene.addAgain(geom);
}

void reAddSome(Scene& scene, int) {
  for (std::size_t i = 0; i < scene.size / 10; ++i) {
    const dGeomID geom = scene.anyGeom();
    scene.remove(geom);
    scene.addAgain(geom);
  }
}

void renewAll(Scene& scene, int) {
  scene.shrinkTo(0);
  scene.addUnitBoxes(scene.size);
}

void nothingLeft(Scene& scene, int frame) {
  if (frame % 2 == 0) {
    scene.addUnitBoxes(scene.size);
    return;
  }
  scene.shrinkTo(0);
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

// Bodies come together into one and part again. Letting a geom go from its body tells the space
// nothing, as its place stays the same, and yet changes its pairs.
void bodiesMergeAndPart(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    for (int i = 0; i < 2; ++i) scene.giveBody(scene.geoms()[i]);
  }
  for (std::size_t i = 2; i < scene.size; ++i) {
    const bool on = frame % 2 == 0 || scene.random.chance(0.5);
    dGeomSetBody(scene.geoms()[i], on ? scene.bodies()[i % 2] : nullptr);
    if (on && frame < 3) {
      const dReal x = scene.between(0, scene.side()), y = scene.between(0, scene.side());
      dGeomSetOffsetPosition(scene.geoms()[i], x, y, x - y);
    }
  }
}

void bodiesSleep(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    for (std::size_t i = 0; i < scene.size; i += 2) scene.giveBody(scene.geoms()[i]);
  }
  for (const dBodyID body : scene.bodies()) {
    if (scene.random.chance(0.5)) {
      dBodyDisable(body);
    } else {
      dBodyEnable(body);
    }
  }
}

void bitsAllOff(Scene&, dGeomID geom, int frame) {
  const bool off = frame % 2 == 0;
  dGeomSetCategoryBits(geom, off ? 0 : ~0ul);
  if (frame > 1) dGeomSetCollideBits(geom, off ? 0 : ~0ul);
}

// One bit each, of all that an unsigned long has, others in every frame.
void singleBits(Scene& scene, dGeomID geom, int) {
  constexpr std::size_t bits = 8 * sizeof(unsigned long);
  dGeomSetCategoryBits(geom, 1ul << scene.random.below(bits));
  dGeomSetCollideBits(
      geom, scene.random.chance(0.5) ? 1ul << scene.random.below(bits) : scene.random.bits());
}

void enabledState(Scene& scene, dGeomID geom, int frame) {
  if (frame == 2 || scene.random.chance(0.5)) {
    dGeomDisable(geom);
  } else {
    dGeomEnable(geom);
  }
}

}  // namespace

Extremes extremeChanges() {
  return {
      {"geoms that cross the world in every frame", eachUnitBox(acrossTheWorld), 1500, 6},
      {"bodies that cross the world in every time step", fastBodies, 1500, 6},
      {"a crowd that scatters and meets again", onUnitBoxes(crowdAndScatter), 1500, 5},
      {"scales from 1e-30 to 1e30 from frame to frame", scaleFromFrameToFrame, 5000, 6},
      {"nothing moves, or one geom", onUnitBoxes(oneMoves), 5000, 8},
      {"all geoms removed and added in every frame", onUnitBoxes(reAddAll)},
      {"a tenth removed and added in every frame", onUnitBoxes(reAddSome), 5000, 6},
      {"all geoms destroyed and made anew in every frame", renewAll},
      {"everything, nothing, everything, nothing", nothingLeft, 5000, 5},
      {"10,000 geoms on one body", onOneBody, 10000, 3},
      {"bodies that merge and part without a move", bodiesMergeAndPart, 700, 6},
      {"bodies that fall asleep and wake", bodiesSleep, 5000, 4},
      {"category bits all off, then all on", eachUnitBox(bitsAllOff), 5000, 5},
      {"single bits of all that a long has", eachUnitBox(singleBits), 5000, 4},
      {"geoms disabled and enabled in every frame", eachUnitBox(enabledState), 5000, 5},
  };
}

}  // namespace sap_test
