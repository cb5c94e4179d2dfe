// The work from which on threads are worth their start, stage by stage: one line for each.
#ifndef ODE_PARALLEL_SAP_GRAINS_H
#define ODE_PARALLEL_SAP_GRAINS_H

#include "space/data/team.h"

namespace ode_parallel_sap {

// A team of two takes about 2 us to start while its threads still spin from the last one, and 10 to
// 50 us once they sleep, as in a frame's first stage; each further thread of a larger one adds some
// 10 us. Beside each grain is what its work takes one thread: the least of many runs on one core
// (AMD EPYC, GCC 12 -O3, double precision; dense cubes of 1,000 to 100,000 boxes), unless something
// else is named.
namespace grains {

// Slots of a scene, all of whose boxes are swept: 90 to 180 ns each, so that a frame of 4,096 takes
// 0.4 ms, and no thread has less than 0.1 ms to do in all of it.
constexpr Grain scene = {1024, Grain::every, 4096};
// Slots of a scene that is found by brute force or axis lists: 0.1 ms for all tests of 1,024.
constexpr Grain scene_of_all_tests = {1024, Grain::whole};

// Slots whose geoms are packed again: 20 to 35 ns each, 20 to 36 us.
constexpr Grain packed_slots = {1024, Grain::further};
// Boxes that are counted by cells of their size: 7 ns each, 14 ns where the counts come from memory
// (1,000,000 boxes); 30 to 60 us.
constexpr Grain counted_boxes = {4096, Grain::further};

// Cells of sixteen boxes that are put into a tree: 40 ns each, 11 us.
constexpr Grain packed_cells = {256, Grain::whole};
// Words of 64 slots each that are compared with those of the last frame: 42 ns each, 43 us.
constexpr Grain looked_at_words = {1024, Grain::whole};
// Records that are sorted, by 19 bits: 4.4 ns each, 72 us.
constexpr Grain sorted_records = {16384, Grain::whole};
// Tests of two boxes by brute force: 0.23 ns each, 60 us.
constexpr Grain box_tests = {1 << 18, Grain::further};
// Boxes whose end points are sorted along three axes: 25 ns each where none has moved, 74 ns of
// 20,000; 25 to 74 us, which three threads share.
constexpr Grain sorted_members = {1000, Grain::whole};
// Pairs of the fullest axis: 5.5 ns each of 1,000 boxes, 21 ns of 20,000; 0.36 ms and more.
constexpr Grain axis_pairs = {1 << 16, Grain::whole};

// Boxes that changed and are looked for in the trees of all others: 0.6 us each of 1,000 among
// 100,000, the trees that are made of them included; 0.3 ms.
constexpr Grain changed_boxes = {512, Grain::further};

// Pairs that the geoms themselves decide: 3 ns each where they are in the cache, 21 ns where they
// are not; 52 us to 0.35 ms.
constexpr Grain exact_tests = {16384, Grain::further};
// Pairs of which both geoms are looked at anew: 7 ns and 42 ns each; 29 us to 0.17 ms.
constexpr Grain verified_pairs = {4096, Grain::further};
// Pairs behind a gap that are moved to close it: 0.2 ns each, 26 us.
constexpr Grain moved_pairs = {1 << 17, Grain::further};
// Tests of sixteen boxes and a half-space: 2.2 ns each, 18 us (results/epyc-2-cores/planes.csv: 40
// planes and 10,000 bodies).
constexpr Grain half_space_tests = {8192, Grain::further};

// Pairs, old and new ones, that are compared: 0.9 ns each where a few differ, 29 us.
constexpr Grain compared_pairs = {1 << 15, Grain::further};
// Pairs that are handed out in blocks: two blocks. Nobody knows what a callback takes for them.
constexpr Grain handed_out_pairs = {1024, Grain::whole};
// Pairs whose geoms are written into the list of the narrow phase: 1 ns each, 8 us.
constexpr Grain listed_pairs = {8192, Grain::whole};
// Pairs that are collided: 0.4 us each of boxes, 0.1 ms.
constexpr Grain collided_pairs = {256, Grain::whole};
// Pairs of colliders that are slower: 1 us each of cylinders, 9 us of meshes of tori
// (results/xeon-16-cores/parts.csv); 4 to 38 us.
constexpr Grain heavy_pairs = {4, Grain::whole};
// Pairs that want an image of ODE: 1.5 us each of boxes and a mesh, 9 us of meshes of tori; 12 to
// 72 us.
constexpr Grain image_pairs = {8, Grain::whole};

// Bytes that are copied to where a device reads them: 50 us at the 8 GB/s that each of six threads
// reaches (cuda/one/upload.cpp).
constexpr Grain sent_bytes = {3 << 17, Grain::whole};
// Words of a device's lists that are expanded to pairs: half of the smallest piece that is asked
// for at once. Not measured apart.
constexpr Grain received_words = {1 << 15, Grain::whole};
// Pairs of a device's axis lists that get their slots, filters and marks: four of the chunks that
// threads take. Not measured apart.
constexpr Grain finished_pairs = {1 << 13, Grain::whole};

}  // namespace grains
}  // namespace ode_parallel_sap

#endif
