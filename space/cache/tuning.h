// The tuned constants of what is kept from one frame to the next.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// When more than one geom in so many changed, all pairs are found anew: of 100,000 cubes, others in
// every frame, a tenth takes 0.75 of the time of that and a quarter 1.23.
constexpr std::size_t changing_share = 8;

// The trees of all boxes are made anew when one box in so many is in the recent ones.
constexpr std::size_t recent_share = 4;

// Cells of changed boxes that a thread takes at a time: few, since some meet far more than others.
constexpr std::size_t changed_chunk_cells = 4;

// Kept pairs that a thread merges at a time; parts that have grown to twice that are cut.
constexpr std::size_t part_pairs = std::size_t{1} << 16;

// How far a fat box lies outside of a box, in parts of the box's least extent; one that its box has
// left twice as far. Piles then have a third more candidates than pairs; with half or twice the
// room extraction takes up to 1.3 times as long in some.
// Unit: 1. From: peers, trembling and pile-cubes.
// Doubled: +1 % of time. Halved: no difference.
constexpr float fat_share = 1.0f / 16;

// Fat boxes are made where boxes would stay in them for so many frames: twice as many as make good
// what that takes.
// Unit: frames. From: peers, pile-cubes and dense-cube.
// Doubled: no difference. Halved: +1 % of time.
constexpr float least_service = 4;

}  // namespace ode_parallel_sap
