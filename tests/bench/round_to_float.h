// Bounds for libraries that compute in float: rounded outward, so that no pair is lost.
#pragma once

#include <cmath>
#include <limits>

namespace bench {

inline float floatBelow(double value) {
  const float rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -std::numeric_limits<float>::infinity())
                         : rounded;
}

inline float floatAbove(double value) {
  const float rounded = static_cast<float>(value);
  return rounded < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
                         : rounded;
}

}  // namespace bench
