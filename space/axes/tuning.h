// The tuned constants of sorted end points.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// A newcomer passes half of all end points: more than one in so many boxes, and all are sorted
// anew.
constexpr std::size_t least_members_a_newcomer = 1024;

}  // namespace ode_parallel_sap
