#include "extreme.h"

#include <cstdio>

namespace sap_test {
namespace physics {

std::string shortNumber(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", number);
  return text;
}

void stack(Stage& stage, int count, double side, const Vec& foot, double density) {
  for (int i = 0; i < count; ++i) {
    stage.box({foot.x, foot.y, foot.z + side * (i + 0.5)}, {side, side, side}, density);
  }
}

const Extremes& extremes() {
  static const Extremes all = [] {
    Extremes extremes;
    for (const auto& theme : {masses, structures, speeds, steps, sizes, places, overlaps, shapes,
                              joints, spins, longRuns, modes}) {
      for (Extreme& extreme : theme()) extremes.push_back(std::move(extreme));
    }
    return extremes;
  }();
  return all;
}

}  // namespace physics
}  // namespace sap_test
