#ifndef PILE_PRESETS_H
#define PILE_PRESETS_H

#include <string>
#include <string_view>
#include <vector>

#include "random.h"
#include "world.h"

namespace pile {

// A scene by name. A new one is a new build function and a row in presets.cpp.
struct Preset {
  const char* name;
  const char* about;
  int bodies;
  int steps;               // about half a minute on two cores
  double dt;               // seconds
  int iterations;          // of QuickStep
  int contacts;            // most of a pair
  double linear_damping;   // rates per second
  double angular_damping;  // this one stands in for rolling friction
  void (*build)(World& world, int bodies, Random& random);
};

// More static geoms than any scene has.
constexpr int most_static_geoms = 1000;

const std::vector<Preset>& presets();

// Throws std::out_of_range for a name that is not there.
const Preset& presetOf(std::string_view name);

}  // namespace pile

#endif
