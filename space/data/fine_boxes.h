// Which boxes of floats are surely not coarse (coarse_growth). Numbers alone, for kernels too.
#pragma once

#include "space/data/tuning.h"

namespace ode_parallel_sap {

// fixed: a box is coarse, too, if its extent comes near the denormals, with which not every device
// computes.
constexpr double least_fine_growth = 1e-37;

// No sum of two bounds' steps is a great part of the size of a box that reaches no further from the
// origin than so many times its largest size.
// fixed: a quarter of a float's steps between two powers of two
constexpr double most_fine_reach = (1 << 21) * coarse_growth;
constexpr double greatest_fine_reach = 1e38;  // fixed: short of infinity in floats
constexpr double least_fine_size = 2 * least_fine_growth / coarse_growth;

}  // namespace ode_parallel_sap
