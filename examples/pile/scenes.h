#ifndef PILE_SCENES_H
#define PILE_SCENES_H

#include <string_view>
#include <vector>

#include "random.h"
#include "world.h"

namespace pile {

// A scene by name. A new one is a new build function and a row of presets() in scenes.cpp.
struct Preset {
  const char* name;
  const char* about;
  int bodies;
  int steps;     // about half a minute on two cores
  double dt;     // seconds
  int contacts;  // most of a pair
  // Fills an empty world with static geometry first, then `bodies` bodies at rest in the air above
  // it, placed, turned and sized by `random`. Lengths are in metres, densities in kg per cubic
  // metre over 1000.
  void (*build)(World& world, int bodies, Random& random);
};

// More static geoms than any scene has.
constexpr int most_static_geoms = 1000;

const std::vector<Preset>& presets();

// Throws std::out_of_range for a name that is not there.
const Preset& presetOf(std::string_view name);

}  // namespace pile

#endif
