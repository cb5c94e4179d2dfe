// The tuned constants that several rooms share, and the work from which on threads are worth their
// start, stage by stage.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/data/team.h"

namespace ode_parallel_sap {

// Up to this number of slots a scene is collided on the spot, without boxes, trees or clocks.
constexpr std::size_t smallest_scene = 120;

// Parts that work is cut into for each thread, where its parts may differ: threads that are done
// early take more.
constexpr std::size_t tasks_a_thread = 16;

// Pairs that a thread takes at a time where all are alike: taking them costs nothing, and what is
// made of them stays in its cache.
constexpr std::size_t chunk_pairs = 4096;

// Pairs of a block that is handed to the program. Which blocks there are depends on this and on the
// pairs alone.
constexpr std::size_t block_pairs = 512;

// Cells that a thread takes at a time: enough to make asking cheap, few enough to keep threads
// level where some cells have many more neighbours than others. Whole nodes of a tree.
constexpr std::size_t chunk_cells = 64;

// How far ahead of its use something that lies anywhere in memory is asked for.
constexpr std::size_t prefetch_distance = 16;

// What turned out not to pay is tried again after this many frames, unless trying costs little.
constexpr int retry_frames = 16;

// A back-off waits at most so many times as long as at first.
constexpr int back_off_range = 64;

// fixed: two seconds of a simulation. Storage that was of no use in so many frames in a row is
// given back: a scene that breathes keeps what it has.
constexpr int idle_frames = 128;

// A box is coarse if rounding to floats lets it grow by more than this part of its largest extent:
// far from the origin for its size, beyond the range of floats or below their smallest steps.
// Unit: 1. From: peers, far from the origin.
// Doubled: +10 % of time. Halved: no difference.
constexpr double coarse_growth = 1.0 / 32;

// Storage from this size on is the system's own pages: the heap would keep what buffers leave
// behind on their way to their size (up to 70 bytes a geom where they hold 170 in the end), and
// pages can be locked for a device (10,000 boxes: 0.9 of the time of the heap's).
constexpr std::size_t least_mapped = std::size_t{1} << 16;

// A team of two takes about 2 us to start while its threads still spin from the last one, and 10 to
// 50 us once they sleep, as in a frame's first stage; each further thread of a larger one adds some
// 10 us. Beside each grain is what its work takes one thread: the least of many runs on one core
// (AMD EPYC, GCC 12 -O3, double precision; dense cubes of 1,000 to 100,000 boxes), unless something
// else is named.
namespace grains {

// Slots of a scene that one thread sweeps in any case: a frame of so many takes 0.4 ms.
// Unit: slots. From: scaling, dense-cube.
// Doubled: no difference. Halved: -5 % of time.
constexpr std::uint64_t swept_alone = 4096;

// Slots of a scene, all of whose boxes are swept: 90 to 180 ns each, so that no thread has less
// than 0.1 ms to do in all of a frame.
constexpr Grain scene = {1024, Grain::every, swept_alone};

// Slots whose geoms are packed again: 20 to 35 ns each, 20 to 36 us.
constexpr Grain packed_slots = {1024, Grain::further};

// Slots of a scene that is found by brute force or axis lists, 0.1 ms for all tests of 1,024; boxes
// whose end points are sorted along three axes, 25 ns each where none has moved.
constexpr Grain scene_of_all_tests = {packed_slots.work, Grain::whole};
constexpr Grain sorted_members = {packed_slots.work, Grain::whole};

// Items of which each is looked up anywhere in memory: boxes that are counted by cells of their
// size, 7 ns each, 14 ns where the counts come from memory; pairs of which both geoms are looked at
// anew, 7 and 42 ns; 29 us to 0.17 ms.
constexpr Grain looked_up = {4096, Grain::further};

// Rows of boxes that are gone through: cells of sixteen that are put into a tree, words of 64 slots
// that are compared with those of the last frame; 40 ns each, 11 us.
constexpr Grain box_rows = {256, Grain::whole};

// Records that are sorted, by 19 bits: 4.4 ns each, 72 us.
constexpr Grain sorted_records = {16384, Grain::whole};

// Tests of two boxes by brute force: 0.23 ns each, 60 us.
constexpr Grain box_tests = {1 << 18, Grain::further};

// Boxes that changed and are looked for in the trees of all others: 0.6 us each of 1,000 among
// 100,000, the trees that are made of them included; 0.3 ms.
constexpr Grain changed_boxes = {512, Grain::further};

// Pairs that the geoms themselves decide, 3 ns each where they are in the cache, 21 ns where they
// are not; tests of sixteen boxes and a half-space, 2.2 ns each; 18 us to 0.17 ms.
// Unit: tests. From: peers, far from the origin; planes.
// Doubled: -5 % of time. Halved: no difference.
constexpr Grain geom_tests = {8192, Grain::further};

// Pairs whose geoms are written into the list of the narrow phase: 1 ns each, 8 us. Pairs of the
// fullest axis of axis lists: 5.5 ns each of 1,000 boxes, 21 ns of 20,000.
constexpr Grain listed_pairs = {geom_tests.work, Grain::whole};
constexpr Grain axis_pairs = {geom_tests.work, Grain::whole};

// Kept pairs of fat boxes, whose boxes are tested: 2 ns each, 17 us.
constexpr Grain tested_candidates = {geom_tests.work, Grain::further};

// Pairs that are gone through in their order: moved to close a gap, 0.2 ns each, or, old and new
// ones, compared, 0.9 ns where a few differ; 13 to 59 us.
constexpr Grain passed_pairs = {1 << 16, Grain::further};

// Pairs that are handed out in blocks: two blocks. Nobody knows what a callback takes for them.
constexpr Grain handed_out_pairs = {2 * block_pairs, Grain::whole};

// Pairs that are collided: 0.4 us each of boxes, 0.1 ms.
constexpr Grain collided_pairs = {256, Grain::whole};

// Pairs of colliders that are slower: 1 us each of cylinders, 1.5 us of boxes and a mesh, 9 us of
// meshes of tori; 8 to 72 us.
constexpr Grain heavy_pairs = {8, Grain::whole};

// Rays that are cast for their nearest hit: 0.5 to 2 us each among 100,000 boxes (ray-benchmark),
// 30 us to 0.1 ms.
constexpr Grain cast_rays = {collided_pairs.work / 4, Grain::whole};

}  // namespace grains

}  // namespace ode_parallel_sap
