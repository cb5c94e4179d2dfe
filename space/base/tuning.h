// The tuned constants that several rooms share, and the work from which on threads are worth their
// start, stage by stage.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/base/team.h"

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

// Cells that a thread takes at a time: enough to make taking them cheap, few enough to keep threads
// level where some cells have many more neighbours than others. Whole nodes of a tree.
constexpr std::size_t chunk_cells = 64;

// How far ahead of its use something that lies anywhere in memory is prefetched.
constexpr std::size_t prefetch_distance = 16;

// What turned out not to pay is tried again after this many frames, unless trying costs little.
constexpr int retry_frames = 16;

// A back-off waits at most so many times as long as at first.
constexpr int back_off_range = 64;

// fixed: two seconds of a simulation. Storage that was of no use in so many frames in a row is
// given back: a scene that breathes keeps what it has.
constexpr int idle_frames = 128;

// Storage from this size on is the system's own pages: the heap would keep what buffers leave
// behind on their way to their size (up to 70 bytes a geom where they hold 170 in the end), and
// pages can be locked for a device (10,000 boxes: 0.9 of the time of the heap's).
constexpr std::size_t least_mapped = std::size_t{1} << 16;

// The work that is worth a thread: 10 us to 0.3 ms on one core (AMD EPYC, GCC 12). A team of two
// takes about 2 us to start while its threads still spin, 10 to 50 us once they sleep.
namespace grains {

// Slots of a scene that one thread sweeps in any case: a frame of so many takes 0.4 ms.
constexpr std::uint64_t swept_alone = 4096;
constexpr Grain scene = {1024, Grain::further, swept_alone};  // slots that are swept

constexpr Grain packed_slots = {1024, Grain::further};      // whose geoms are packed again
constexpr Grain scene_of_all_tests = {1024, Grain::whole};  // slots: brute force, axis lists
constexpr Grain sorted_members = {1024, Grain::whole};      // boxes whose end points are sorted
constexpr Grain looked_up = {4096, Grain::further};         // items anywhere in memory
constexpr Grain box_rows = {256, Grain::whole};             // cells of sixteen, words of 64 slots
constexpr Grain sorted_records = {16384, Grain::whole};
constexpr Grain box_tests = {1 << 18, Grain::further};       // of two boxes, by brute force
constexpr Grain changed_boxes = {512, Grain::further};       // that meet trees of all others
constexpr Grain geom_tests = {8192, Grain::further};         // pairs that the geoms decide
constexpr Grain listed_pairs = {8192, Grain::whole};         // for the narrow phase
constexpr Grain axis_pairs = {8192, Grain::whole};           // of the fullest axis of axis lists
constexpr Grain tested_candidates = {8192, Grain::further};  // pairs of fat boxes
constexpr Grain passed_pairs = {1 << 16, Grain::further};    // gone through in their order
constexpr Grain handed_out_pairs = {2 * block_pairs, Grain::whole};
constexpr Grain collided_pairs = {256, Grain::whole};
constexpr Grain heavy_pairs = {8, Grain::whole};  // of slow colliders
constexpr Grain cast_rays = {64, Grain::whole};   // for their nearest hits

}  // namespace grains

}  // namespace ode_parallel_sap
