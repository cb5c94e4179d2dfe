// The floating-point modes of threads, as the library sets them; on x86 and ARM also by the C
// library, which is the way on any other processor (CMakeLists.txt).
#include "space/base/floating_point.h"

#include <limits>

#include "support/catch.hpp"
#include "support/floating_point.h"

using namespace ode_parallel_sap;

namespace {

// Not the usual one first: whoever asks for exactMode() first may run in any.
constexpr unsigned modes[] = {
    sap_test::FloatingPointMode::kFlushing, sap_test::FloatingPointMode::kDownward,
    sap_test::FloatingPointMode::kUpward, sap_test::FloatingPointMode::kTowardZero,
    sap_test::FloatingPointMode::kDefault};

// What the processor does at this moment.
struct Arithmetic {
  bool keeps_denormals, reads_denormals, rounds_to_nearest;
};

template <class Real>
Arithmetic arithmetic() {
  volatile Real least = std::numeric_limits<Real>::min(), zero = 0, one = 1;
  volatile Real denormal = std::numeric_limits<Real>::denorm_min();
  volatile Real little = std::numeric_limits<Real>::epsilon() / 8;
  volatile Real half = least / 2;
  // Volatile as well: compilers may move other arithmetic past a change of the mode.
  volatile const bool keeps = half > zero, reads = denormal > zero;
  volatile const bool above = one + little == one, below = one - little == one;
  volatile const bool mirrored = -one - little == -one && -one + little == -one;
  return {keeps, reads, above && below && mirrored};
}

}  // namespace

TEST_CASE(
    "In exactMode() denormals are kept and rounding is to nearest, whatever the mode before") {
  for (const unsigned mode : modes) {
    INFO("mode " << std::hex << mode);
    const sap_test::FloatingPointMode before(mode);
    const auto [floats, doubles] = [] {
      const ScopedMode exact(exactMode());
      return std::pair{arithmetic<float>(), arithmetic<double>()};
    }();
    const unsigned after = sap_test::FloatingPointMode::current();
    const sap_test::FloatingPointMode usual(sap_test::FloatingPointMode::kDefault);
    for (const Arithmetic& found : {floats, doubles}) {
      CHECK(found.keeps_denormals);
      CHECK(found.reads_denormals);
      CHECK(found.rounds_to_nearest);
    }
    CHECK(after == mode);
  }
}

TEST_CASE("The modes of these tests do what their names say", "[modes]") {
  if (!sap_test::FloatingPointMode::kCanBeSet) {
    WARN("SKIPPED: modes cannot be set here");
    return;
  }
  for (const unsigned mode : modes) {
    INFO("mode " << std::hex << mode);
    const Arithmetic found = [=] {
      const sap_test::FloatingPointMode scoped(mode);
      return arithmetic<double>();
    }();
    const bool flushing = mode == sap_test::FloatingPointMode::kFlushing;
    const bool nearest = flushing || mode == sap_test::FloatingPointMode::kDefault;
    CHECK(found.keeps_denormals == !flushing);
    CHECK(found.reads_denormals == !flushing);
    CHECK(found.rounds_to_nearest == nearest);
  }
}
