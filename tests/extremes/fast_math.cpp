// A program that was compiled with -ffast-math: from its start on denormals are flushed, in numbers
// it reads and in numbers it makes.
#include "../support/floating_point.h"

#include "../support/catch.hpp"

#if !defined(__FAST_MATH__)
#error "to be compiled with -ffast-math"
#endif

using namespace sap_test;

TEST_CASE("Denormals are flushed from the start of the program on", "[extremes]") {
  if (!FloatingPointMode::kCanBeSet) return;
  CHECK(FloatingPointMode::current() == FloatingPointMode::kFlushing);
}
