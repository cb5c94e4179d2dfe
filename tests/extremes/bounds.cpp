// Infinite, NaN, inverted.
#include <array>
#include <utility>

#include "extreme.h"

namespace sap_test {
namespace {

Bounds unitBounds(Scene& scene) {
  const dReal x = scene.between(0, scene.side()), y = scene.between(0, scene.side());
  const dReal z = scene.between(0, scene.side());
  return {x, x + 1, y, y + 1, z, z + 1};
}

// Unit boxes, and a few whose bounds are infinite where `low` and `high` say so; they change places
// with finite ones.
Play infinite(int first_axis, int last_axis, bool low, bool high) {
  return [=](Scene& scene, int frame) {
    if (frame == 0) {
      scene.addUnitBoxes(scene.size);
      for (int i = 0; i < 8; ++i) scene.marked.push_back(scene.addUserBox(unitBounds(scene)));
    }
    for (std::size_t i = 0; i < scene.marked.size(); ++i) {
      Bounds bounds = unitBounds(scene);
      for (int axis = first_axis; axis <= last_axis && (i + frame) % 3; ++axis) {
        if (low) bounds[2 * axis] = -kInfinity;
        if (high) bounds[2 * axis + 1] = kInfinity;
      }
      setUserBounds(scene.marked[i], bounds);
    }
    scene.placeAnywhere(scene.anyGeom());
  };
}

void nothingButInfinite(Scene& scene, int) {
  for (std::size_t i = 0; i < scene.size; ++i) {
    Bounds bounds = unitBounds(scene);
    const std::size_t axis = scene.random.below(3), which = 1 + scene.random.below(3);
    if (which & 1) bounds[2 * axis] = -kInfinity;
    if (which & 2) bounds[2 * axis + 1] = kInfinity;
    scene.setUserBox(i, bounds);
  }
}

// Infinite sizes of ODE's own classes: some of their bounds are infinite, others NaN.
void infiniteClasses(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    scene.marked.push_back(scene.take(dCreateSphere(scene.space(), kInfinity)));
    scene.marked.push_back(scene.take(dCreateBox(scene.space(), 1, kInfinity, 1)));
    scene.marked.push_back(scene.take(dCreateCapsule(scene.space(), 1, kInfinity)));
    scene.marked.push_back(scene.take(dCreateRay(scene.space(), kInfinity)));
    scene.marked.push_back(scene.take(dCreateSphere(scene.space(), 1)));
  }
  for (const dGeomID geom : scene.marked) scene.placeAnywhere(geom);
  scene.place(scene.marked.back(), frame % 2 ? kInfinity : 1, frame % 3 ? -kInfinity : 1, 1);
}

// A NaN that comes and goes: frames 1 and 2 have it.
bool isSick(int frame) {
  return frame == 1 || frame == 2;
}

void nanSize(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    for (int i = 0; i < 12; ++i) scene.marked.push_back(scene.addUserBox(unitBounds(scene)));
  }
  for (std::size_t i = 0; i < scene.marked.size(); ++i) {
    Bounds bounds = unitBounds(scene);
    bounds[i % 6] = isSick(frame) ? kNaN : bounds[i % 6];
    if (i % 4 == 0) bounds[(i + 1) % 6] = i % 2 ? -kInfinity : kInfinity;
    setUserBounds(scene.marked[i], bounds);
  }
}

void inverted(Scene& scene, int frame) {
  for (std::size_t i = 0; i < scene.size; ++i) {
    Bounds bounds = unitBounds(scene);
    const std::size_t axis = scene.random.below(3);
    if (scene.random.chance(0.3)) std::swap(bounds[2 * axis], bounds[2 * axis + 1]);
    if (scene.random.chance(0.1)) std::swap(bounds[0], bounds[1]);
    if (frame == 0 || scene.random.chance(0.5)) scene.setUserBox(i, bounds);
  }
}

}  // namespace

Extremes extremeBounds() {
  Extremes all;
  const char* const axes[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    const std::string along = std::string(" along ") + axes[axis];
    all.push_back({"half-infinite boxes down" + along, infinite(axis, axis, true, false)});
    all.push_back({"half-infinite boxes up" + along, infinite(axis, axis, false, true)});
    all.push_back({"infinite boxes" + along, infinite(axis, axis, true, true)});
  }
  all.push_back({"boxes infinite in all directions", infinite(0, 2, true, true)});
  all.push_back({"nothing but infinite boxes", nothingButInfinite, 700});
  all.push_back({"ODE's classes with infinite sizes and places", infiniteClasses});
  all.push_back({"NaN bounds of user classes", nanSize});
  all.push_back({"inverted boxes", inverted, 1500});
  return all;
}

}  // namespace sap_test
