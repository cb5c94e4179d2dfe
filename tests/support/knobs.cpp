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

}  // namespace sap_test
