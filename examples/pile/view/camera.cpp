#include "camera.h"

#include <algorithm>
#include <cmath>

namespace pile {

Camera cameraFor(const World& world) {
  constexpr double degree = 3.14159265358979 / 180;
  constexpr double heading = 125;
  constexpr double pitch = -27;
  constexpr double sizes_away = 50;      // of a body, which then is ten pixels wide
  constexpr double deviations_away = 3;  // of the bodies' distances from their middle

  std::array<double, 3> middle = {0, 0, 0}, square = {0, 0, 0};
  double count = 0;
  for (dBodyID body : world.bodies()) {
    const dReal* place = dBodyGetPosition(body);
    if (!std::isfinite(place[0] + place[1] + place[2])) continue;
    ++count;
    for (size_t i = 0; i < 3; ++i) {
      middle[i] += place[i];
      square[i] += static_cast<double>(place[i]) * place[i];
    }
  }
  double variance = 0;
  for (size_t i = 0; i < 3; ++i) {
    middle[i] /= std::max(count, 1.0);
    variance += square[i] / std::max(count, 1.0) - middle[i] * middle[i];
  }
  const double distance =
      std::min(sizes_away * world.body_size,
               deviations_away * (world.body_size + std::sqrt(std::max(variance, 0.0))));
  return {{middle[0] - distance * std::cos(heading * degree) * std::cos(pitch * degree),
           middle[1] - distance * std::sin(heading * degree) * std::cos(pitch * degree),
           middle[2] - distance * std::sin(pitch * degree)},
          heading,
          pitch};
}

}  // namespace pile
