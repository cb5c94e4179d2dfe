// Denormal, huge, long and thin.
#include <cmath>

#include "extreme.h"

namespace sap_test {
namespace {

// A user box around a place, so that no ODE class rounds its extents.
Bounds around(double x, double y, double z, double width, double depth, double height) {
  return {real(x - width / 2), real(x + width / 2),  real(y - depth / 2),
          real(y + depth / 2), real(z - height / 2), real(z + height / 2)};
}

void give(Scene& scene, int frame, std::size_t i, const Bounds& bounds) {
  if (frame == 0 || scene.random.chance(0.5)) scene.setUserBox(i, bounds);
}

double smallest() {
  return static_cast<double>(kDenormal);
}

// Log-uniform from the smallest denormal to 1e9, near the origin, where each size has company.
void denormalTo1e9(Scene& scene, int frame) {
  const double low = std::log(smallest()), high = std::log(1e9);
  for (std::size_t i = 0; i < scene.size; ++i) {
    const double size = std::exp(scene.random.between(low, high)), reach = 3 * size;
    const double x = scene.random.between(-reach, reach), y = scene.random.between(-reach, reach);
    give(scene, frame, i,
         around(x, y, scene.random.between(-reach, reach), size,
                size * scene.random.between(0.1, 1), size * scene.random.between(0.1, 1)));
  }
}

void denormalsOnly(Scene& scene, int frame) {
  for (std::size_t i = 0; i < scene.size; ++i) {
    Bounds bounds;
    for (int axis = 0; axis < 3; ++axis) {
      const dReal low = real(scene.random.below(40)) - 20;
      bounds[2 * axis] = low * kDenormal;
      bounds[2 * axis + 1] = (low + real(scene.random.below(6))) * kDenormal;
    }
    give(scene, frame, i, bounds);
  }
}

// Around the smallest normal number, where denormals begin.
void aroundTheSmallestNormal(Scene& scene, int frame) {
  const double unit = static_cast<double>(std::numeric_limits<dReal>::min());
  for (std::size_t i = 0; i < scene.size; ++i) {
    const double x = scene.random.between(-8, 8), y = scene.random.between(-8, 8);
    const double z = scene.random.between(-8, 8), size = scene.random.between(0.5, 2);
    give(scene, frame, i,
         around(x * unit, y * unit, z * unit, size * unit, size * unit, size * unit));
  }
}

// Bars and plates: one extent, or two, 1e6 times the rest.
Play elongated(int long_axes, double ratio) {
  return [long_axes, ratio](Scene& scene, int frame) {
    const double side = scene.side() * 4;
    for (std::size_t i = 0; i < scene.size; ++i) {
      double extent[3] = {1, 1, 1};
      const std::size_t axis = scene.random.below(3);
      extent[axis] = ratio;
      if (long_axes == 2) extent[(axis + 1) % 3] = ratio;
      const double x = scene.random.between(0, side), y = scene.random.between(0, side);
      give(scene, frame, i,
           around(x, y, scene.random.between(0, side), extent[0], extent[1], extent[2]));
    }
  };
}

// The same as boxes of ODE's, turned, whose AABBs are then large in all directions.
void turnedBars(Scene& scene, dGeomID geom, int frame) {
  if (frame == 0 && number(geom) % 50 == 0) dGeomBoxSetLengths(geom, dReal(1e6), 1, 1);
  dMatrix3 rotation;
  const dReal a = scene.between(-3, 3), b = scene.between(-3, 3);
  dRFromEulerAngles(rotation, a, b, scene.between(-3, 3));
  dGeomSetRotation(geom, rotation);
}

void largestAmongUnits(Scene& scene, int frame) {
  if (frame == 0) {
    scene.addUnitBoxes(scene.size);
    for (const double part : {1.0, 0.5, 1e-3}) {
      const dReal reach = real(static_cast<double>(kLargest) * part);
      scene.marked.push_back(scene.addUserBox({-reach, reach, 1, 2, -reach, reach}));
      scene.marked.push_back(scene.addUserBox({-reach, reach, -reach, reach, -reach, reach}));
    }
  } else {
    const dReal at = real(frame);
    setUserBounds(scene.marked[0], {at, kLargest, -kLargest, at, at, at + 1});
    scene.placeAnywhere(scene.geoms()[0]);
  }
}

void hugeSpheres(Scene& scene, int frame) {
  for (std::size_t i = 0; i < scene.size; ++i) {
    const dReal radius = real(std::pow(10, scene.random.between(-6, 30)));
    if (frame == 0) {
      scene.take(dCreateSphere(scene.space(), radius));
    } else {
      dGeomSphereSetRadius(scene.geoms()[i], radius);
    }
    const dReal x = scene.between(-2, 2), y = scene.between(-2, 2), z = scene.between(-2, 2);
    scene.place(scene.geoms()[i], radius * x, radius * y, radius * z);
  }
}

}  // namespace

Extremes extremeSizes() {
  return {
      {"denormal to 1e9 in one scene", denormalTo1e9, 1500},
      {"denormal coordinates only", denormalsOnly, 1500},
      {"around the smallest normal number", aroundTheSmallestNormal, 1500},
      {"bars 1e6 times as long as wide", elongated(1, 1e6), 1500},
      {"plates 1e6 times as wide as thick", elongated(2, 1e6), 700},
      {"turned bars of 1e6 among unit boxes", eachUnitBox(turnedBars), 1500},
      {"boxes of the type's largest extent among unit boxes", largestAmongUnits, 5000},
      {"spheres with radii of 1e-6 to 1e30", hugeSpheres, 1500},
  };
}

}  // namespace sap_test
