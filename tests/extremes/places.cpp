// Far away, far apart, all in one place, just touching.
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

// Two crowds that just touch, or just do not.
void inTwoPlaces(Scene& scene, dGeomID geom, int frame) {
  const dReal gap = frame % 2 ? std::numeric_limits<dReal>::epsilon() * 2 : 0;
  scene.place(geom, number(geom) % 2 ? dReal(1.5) + gap : dReal(0.5), 0, 0);
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
  all.push_back({"two crowds that touch, or just do not", eachUnitBox(inTwoPlaces), 700});
  all.push_back({"a lattice that touches all over", lattice(1, 0), 5000, 2});
  all.push_back({"a lattice of steps of 0.1", lattice(0.1, 0), 5000, 2});
  all.push_back({"a lattice of steps of 0.1, 1e6 away", lattice(0.1, 1e6), 1500, 2});
  all.push_back({"boxes without extent in a lattice", flatBoxes, 1500, 2});
  return all;
}

}  // namespace sap_test
