// Spaces in spaces in spaces, and spaces with nothing in them.
#include "extreme.h"

namespace sap_test {
namespace {

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

}  // namespace

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

}  // namespace sap_test
