// Far away, far apart, all in one place, just touching; minute, huge, long and thin.
#include <cmath>
#include <sstream>

#include "extreme.h"

namespace sap_test {
namespace {

std::string text(double value) {
  std::ostringstream stream;
  stream << value;
  return stream.str();
}

// Unit boxes of ODE's, a dense cube of them, at a distance along all axes.
Extreme unitBoxesAt(double distance) {
  const Play play = eachUnitBox([distance](Scene& scene, dGeomID geom, int) {
    const dReal x = scene.between(0, scene.side()), y = scene.between(0, scene.side());
    scene.place(geom, real(distance) + x, real(-distance) + y,
                real(distance) + scene.between(0, scene.side()));
  });
  // Where neighbouring numbers are further apart than the boxes, all are in a few places.
  return {"unit boxes " + text(distance) + " from the origin", play, 1500, 2};
}

// All coordinates and sizes times a factor; the largest leaves a little room for sums.
Extreme everythingTimes(double factor, const std::string& name) {
  const auto play = [factor](Scene& scene, int frame) {
    for (const Box& box : denseCube(scene.size, scene.random.bits())) {
      Bounds bounds;
      for (int i = 0; i < 6; ++i) {
        const double* const bound = i % 2 ? box.high : box.low;
        const double at = bound[i / 2] - scene.side() / 2;
        bounds[i] = real(at / (scene.side() + 2) * factor);
      }
      if (frame == 0) {
        scene.addUserBox(bounds);
      } else {
        setUserBounds(scene.geoms()[scene.random.below(scene.size)], bounds);
      }
    }
  };
  return {name, play, 5000, 2};
}

Extreme clustersApart(double distance) {
  const Play play = eachUnitBox([distance](Scene& scene, dGeomID geom, int) {
    const dReal shift = number(geom) % 2 ? real(distance) : 0;
    const dReal x = scene.between(0, scene.side()), y = scene.between(0, scene.side());
    scene.place(geom, shift + x, y, scene.between(0, scene.side()) - shift);
  });
  return {"two clusters " + text(distance) + " apart", play, 1500, 3};
}

void inOnePlace(Scene& scene, dGeomID geom, int frame) {
  scene.place(geom, real(frame), 2, 3);
}

// A lattice whose boxes touch their neighbours in faces, edges and corners; steps that binary
// numbers do not have make it a matter of rounding which of them do.
Play lattice(double step, double offset) {
  return [step, offset](Scene& scene, int) {
    std::size_t at = 0;
    for (const Box& box : touchingLattice(scene.size, scene.random.bits())) {
      Bounds bounds;
      for (int i = 0; i < 6; ++i) {
        const double* const bound = i % 2 ? box.high : box.low;
        bounds[i] = real(bound[i / 2] * step + offset);
      }
      scene.setUserBox(at++, bounds);
    }
  };
}

void flatBoxes(Scene& scene, int) {
  // Planes of paper in one another: extents of zero, bounds in common.
  for (std::size_t i = 0; i < scene.size; ++i) {
    Bounds bounds;
    for (int axis = 0; axis < 3; ++axis) {
      const dReal low = real(scene.random.below(8));
      bounds[2 * axis] = low;
      bounds[2 * axis + 1] = low + real(scene.random.below(2));
    }
    scene.setUserBox(i, bounds);
  }
}

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

}  // namespace

Extremes extremePlaces() {
  Extremes all;
  for (const double distance : {1e6, 1e9, 1e12, 1e15, 1e18, 1e30}) {
    all.push_back(unitBoxesAt(distance));
  }
  for (const double factor : {1e6, 1e12, 1e30}) {
    all.push_back(everythingTimes(factor, "a scene " + text(factor) + " wide"));
  }
  const double largest = static_cast<double>(kLargest);
  all.push_back(everythingTimes(largest, "a scene as wide as the type's largest number"));
  all.push_back(everythingTimes(2 * largest, "a scene that reaches both ends of the type's range"));
  for (const double distance : {1e6, 1e12, 1e30}) all.push_back(clustersApart(distance));
  all.push_back({"all boxes in one place", eachUnitBox(inOnePlace), 700});
  all.push_back({"a lattice that touches all over", lattice(1, 0), 5000, 2});
  all.push_back({"a lattice of steps of 0.1", lattice(0.1, 0), 5000, 2});
  all.push_back({"a lattice of steps of 0.1, 1e6 away", lattice(0.1, 1e6), 1500, 2});
  all.push_back({"boxes without extent in a lattice", flatBoxes, 1500, 2});
  all.push_back({"denormal to 1e9 in one scene", denormalTo1e9, 1500});
  all.push_back({"around the smallest normal number", aroundTheSmallestNormal, 1500});
  all.push_back({"bars 1e6 times as long as wide", elongated(1, 1e6), 1500});
  all.push_back({"plates 1e6 times as wide as thick", elongated(2, 1e6), 700});
  all.push_back({"boxes of the type's largest extent among unit boxes", largestAmongUnits, 5000});
  return all;
}

}  // namespace sap_test
