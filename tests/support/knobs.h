// What a person may turn from outside, by environment variables.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sap_test {

// ODE_PARALLEL_SAP_TEST_SEED, if set, takes the place of every seed the tests would use. Where a
// test makes several runs, each has a seed of its own, the next one; a failure tells that of its
// run, with which the first run is the one that failed.
std::uint64_t seedOr(std::uint64_t usual, int run = 0);

// ODE_PARALLEL_SAP_TEST_SCALE (a positive number, 1 if not set) multiplies the counts of random
// work: 0.1 under a sanitizer, 100 for a night. At least 1 is left.
int scaled(int usual);

// The geoms of a scene of `usual`: fewer where ODE_PARALLEL_SAP_TEST_GRAIN makes teams of little
// work, since all that takes thousands of geoms happens with some hundred then.
std::size_t geomsOf(std::size_t usual);

}  // namespace sap_test
