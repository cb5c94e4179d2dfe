// The tuned constants of what is kept from one frame to the next.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// When more than one geom in so many changed, all pairs are found anew: of 100,000 cubes, others in
// every frame, a tenth takes 0.75 of the time of that and a quarter 1.23.
// Unit: geoms. From: rest-benchmark.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t changing_share = 8;

// A level of trees is merged into the next one when it is no longer this many times smaller, and
// all of them into the base when together they are.
// Unit: 1. From: rest-benchmark.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t level_ratio = 4;

// Cells of changed boxes that a thread takes at a time: few, since some meet far more than others.
// Unit: cells. From: rest-benchmark on 16 threads.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t changed_chunk_cells = 4;

// Kept pairs that a thread merges at a time; parts that have grown to twice that are cut.
// Unit: pairs. From: rest-benchmark on 16 threads.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t part_pairs = std::size_t{1} << 16;

// A fat box lies this share of a box's least extent outside of it; one that its box has left, twice
// as far.
// Unit: 1. From: peers, piles: 1/8 and 1/32 take 1.1 to 1.3 times as long to extract.
constexpr float fat_share = 1.0f / 16;

// Fat boxes are made where boxes would stay in them for so many frames.
// Unit: frames. From: peers, trembling and brownian.
constexpr float least_service = 4;

// When more than one box in so many leaves its fat one, all are made anew.
// Unit: boxes. From: peers, piles.
constexpr std::size_t leaving_share = 16;

// Boxes whose way is followed: one in so many, enough to tell whether an eighth is fast.
// Looking at one takes 4 ns.
// Unit: boxes. From: peers, dense-cube of 300.
constexpr std::size_t sampled_share = 16;
constexpr std::size_t most_sampled = 128;  // fixed: what more would tell is not needed

}  // namespace ode_parallel_sap
