// Scenes that go to an extreme, for any kind of space: what a broad phase meets in a program that
// has gone wrong, or is larger, smaller, faster or stranger than its author thought.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "../support/configurations.h"
#include "../support/floating_point.h"
#include "../support/not_finite.h"
#include "../support/random.h"
#include "../support/recorder.h"
#include "../support/scenes.h"
#include "../support/user_box.h"

namespace sap_test {

constexpr dReal kLargest = std::numeric_limits<dReal>::max();
constexpr dReal kDenormal = std::numeric_limits<dReal>::denorm_min();

// A space of the kind under test with its geoms, and all that an extreme wants to remember.
class Scene : private Space, public World {
 public:
  Scene(const Configuration& configuration, int threads, std::size_t size, std::uint64_t seed)
      : Space(configuration), World(dSpaceID(*this)), size(size), random(seed) {
    if (threads > 0) dParallelSAPSpaceSetNumThreads(space(), threads);
  }

  dReal between(double low, double high) { return real(random.between(low, high)); }
  dGeomID anyGeom() { return geoms()[random.below(geoms().size())]; }
  // Unit boxes of ODE's in a cube in which each overlaps a few of size others.
  void addUnitBoxes(std::size_t n);
  dGeomID addUserBox(const Bounds& bounds) { return take(createUserBox(space(), bounds)); }
  // Gives geom number i these bounds, and adds it if there are just i.
  void setUserBox(std::size_t i, const Bounds& bounds) {
    i < geoms().size() ? setUserBounds(geoms()[i], bounds) : void(addUserBox(bounds));
  }
  void place(dGeomID geom, dReal x, dReal y, dReal z) { dGeomSetPosition(geom, x, y, z); }
  // Somewhere in that cube.
  void placeAnywhere(dGeomID geom);
  double side() const;

  const std::size_t size;  // geoms, about
  Random random;
  std::vector<dGeomID> marked;
  std::vector<dSpaceID> spaces;
};

// Builds a scene in frame 0 and changes it in the frames after that. What it does depends on the
// scene's size and random numbers only.
using Play = std::function<void(Scene& scene, int frame)>;
// Of unit boxes, which are changed in every frame, together or each.
Play onUnitBoxes(Play change);
Play eachUnitBox(std::function<void(Scene& scene, dGeomID geom, int frame)> change);

struct Extreme {
  std::string name;
  Play play;
  std::size_t most = 5000;  // geoms up to which it is sensible: quadratic output
  int frames = 4;
  // In which the program collides.
  unsigned mode = FloatingPointMode::current();
};

using Extremes = std::vector<Extreme>;
Extremes extremePlaces();
Extremes extremeBounds();
Extremes extremeChanges();

}  // namespace sap_test
