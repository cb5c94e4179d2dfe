#include "knobs.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace sap_test {

std::uint64_t seedOr(std::uint64_t usual, int run) {
  const char* text = std::getenv("ODE_PARALLEL_SAP_TEST_SEED");
  return (text ? std::stoull(text) : usual) + static_cast<std::uint64_t>(run);
}

int scaled(int usual) {
  const char* text = std::getenv("ODE_PARALLEL_SAP_TEST_SCALE");
  if (!text) return usual;
  const double scale = std::stod(text);
  if (!(scale > 0)) throw std::invalid_argument("ODE_PARALLEL_SAP_TEST_SCALE must be positive");
  return std::max(1, static_cast<int>(std::lround(usual * scale)));
}

std::size_t geomsOf(std::size_t usual) {
  constexpr std::size_t some_hundred = 400;
  return std::getenv("ODE_PARALLEL_SAP_TEST_GRAIN") ? std::min(usual, some_hundred) : usual;
}

}  // namespace sap_test
