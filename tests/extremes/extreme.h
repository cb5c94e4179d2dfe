// Scenes that go to an extreme, for any kind of space: what a broad phase meets in a program that
// has gone wrong, or is larger, smaller, faster or stranger than its author thought.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <functional>
#include <string>
#include <vector>

#include "../support/configurations.h"
#include "../support/floating_point.h"
#include "../support/random.h"
#include "../support/scenes.h"

namespace sap_test {

// A space of the kind under test with its geoms, and all that an extreme wants to remember.
struct Scene : private Space, World {
  Scene(const Configuration& configuration, int threads, std::size_t its_size, std::uint64_t seed);

  const std::size_t size;  // geoms, about
  const double side;       // of a cube in which each of so many unit boxes overlaps a few others
  Random random;
  std::vector<dGeomID> marked;
};

struct Extreme {
  std::string name;
  // Builds a scene in frame 0 and changes it in the frames after that. What it does depends on the
  // scene's size and random numbers only.
  std::function<void(Scene& scene, int frame)> play;
  std::size_t most = 5000;  // geoms up to which it is sensible: quadratic output
  int frames = 4;
  // In which the program collides.
  unsigned mode = FloatingPointMode::current();
};

std::vector<Extreme> extremes();

}  // namespace sap_test
