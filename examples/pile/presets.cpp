#include "presets.h"

#include <algorithm>
#include <stdexcept>

#include "scenes.h"

namespace pile {

const std::vector<Preset>& presets() {
  // name, about, bodies, steps, dt, iterations, contacts, damping linear and angular, build
  static const std::vector<Preset> all = {
      {"cubes", "20,000 boxes onto a terrain of 300,000 triangles", 20000, 300, 0.01, 20, 4, 0.1, 2,
       buildCubes},
      {"balls", "10,000 spheres into a bowl of 600 triangles", 10000, 450, 0.01, 20, 2, 0.1, 2,
       buildBalls},
      {"skittles", "3,500 bowling pins of 20,000 triangles each onto a plane", 3500, 200, 0.005, 20,
       6, 0.1, 2, buildSkittles},
      {"torus", "1,000 tori of 2,304 triangles each onto a plane", 1000, 500, 0.005, 20, 6, 0.1, 2,
       buildTorus},
      {"alphabet", "260 letters, all different, of 31,680 triangles in all onto a plane", 260, 4000,
       0.005, 20, 6, 0.1, 2, buildAlphabet}};
  return all;
}

const Preset& presetOf(std::string_view name) {
  for (const Preset& preset : presets())
    if (name == preset.name) return preset;
  throw std::out_of_range("no scene " + std::string(name));
}

}  // namespace pile
