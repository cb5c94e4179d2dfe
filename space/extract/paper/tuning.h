// The tuned constants of brute force.
#pragma once

#include <cstdint>

namespace ode_parallel_sap {

// Tests a box after which a dense scene must have shown to be one: a sixteenth of what the sweep of
// moved boxes takes (10,000 boxes, one thread: 0.25 ns a test, 260 ns a box). Unit: tests. From:
// peers, crowd-and-cube.
// Doubled: no difference. Halved: no difference.
constexpr std::uint64_t first_tests_a_box = 64;

}  // namespace ode_parallel_sap
