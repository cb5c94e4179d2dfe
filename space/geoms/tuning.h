// The tuned constants of boxes made of geoms.
#pragma once

#include <cstddef>

#include "space/base/tuning.h"

namespace ode_parallel_sap {

// Geoms are brought up to date in blocks of so many: their poses and bounds are asked for while
// they are listed.
constexpr std::size_t update_block = prefetch_distance;

// How far ahead a geom is asked for that is only looked at: a look takes a few ns, a line from
// memory a hundred times as long.
// Unit: geoms. From: peers, dense-cube at rest, 10,000 to 1,000,000 geoms.
// Doubled: 0.87 to 1.08 of the time. Halved: 0.88 to 1.33.
constexpr std::size_t look_distance = 4 * prefetch_distance;

}  // namespace ode_parallel_sap
