// The tuned constants, and the work from which on threads are worth their start, stage by stage;
// and back-offs. Round numbers, half or twice of which would do, stand where they are used.
#pragma once

#include <algorithm>
#include <cstddef>

#include "space/base/parallel.h"

namespace ode_parallel_sap {

// Up to this number of slots a scene is collided on the spot, without boxes, trees or clocks.
constexpr std::size_t small_scene_slots = 120;

// Parts that work is cut into for each thread, where they differ: threads done early take more.
constexpr std::size_t tasks_a_thread = 16;

// Items of a task, so that there are about so many tasks. A team of one has one task.
constexpr std::size_t taskSize(std::size_t count, int team) {
  const std::size_t tasks = team > 1 ? tasks_a_thread * static_cast<std::size_t>(team) : 1;
  return std::max<std::size_t>((count + tasks - 1) / tasks, 1);
}

// Pairs that a thread takes at a time where all are alike.
constexpr std::size_t chunk_pairs = 4096;

// Cells, in whole nodes, or changed boxes that a thread takes at a time: some meet far more.
constexpr std::size_t chunk_searches = 64;

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

// Geoms.

// Slots of whose geoms a table is larger than what a core has of caches for itself. At 100,000
// asking for them ahead cost a third of a report that only counts, at 1,000,000 it saved a third.
constexpr std::size_t far_slots = std::size_t{1} << 18;

// From this number of threads on, the geoms of a large scene's pairs are looked up before the
// report, by all threads. Of 4.6 million pairs it took 0.75 to 0.79 of the time on 16 threads, 0.77
// on 8, and 1.15 times as long on 4.
constexpr int least_resolving_threads = 8;

// Pairs whose geoms are looked up at a time, 2 MB. To a callback that counts they are reported
// before the threads fall asleep: with 2^20 the report took 1.08 times as long.
constexpr std::size_t resolved_pairs = std::size_t{1} << 17;

// How far ahead a geom is prefetched that is only compared: that takes a few ns, a line from memory
// a hundred times as long. Half as far took up to 1.33 times as long (peers, at rest).
constexpr std::size_t compare_distance = 4 * prefetch_distance;

// Cells, and sorting pairs.

// By how much cells may have grown on average.
constexpr double most_growth = 0.4;

// Cells that drift through each other without growing show when cut anew: after so many frames.
constexpr int longest_reuse = 32;

// Regions that boxes are dealt into: their counters stay within the second-level cache.
constexpr std::size_t most_regions = 2048;

// An axis divides boxes into short and long ones if these are this many times as long on average.
constexpr double far_longer = 8;

// Inner loops.

// Cells whose boxes are prefetched before they are packed.
constexpr std::size_t packed_ahead = 3;

// From frame to frame.

// When more than one geom in so many changed, all pairs are found anew: of 400,000 spheres, the
// same tenth in every frame, that is 1.25 times faster.
constexpr std::size_t changed_share = 16;

// How far fat boxes lie outside of boxes, in parts of a box's least extent: the first where boxes
// move slowly, the last where they tremble farther, and for a box that has left its fat one. Fat
// boxes of equal cubes at random places have 1.4 and 2 times as many pairs as the cubes. With the
// last, frames of trembling boxes took 0.55 to 0.85 of the time, but extraction 1.1 to 1.3 times as
// long for a million of them, which lie in memory: it is left out above half of far_slots.
constexpr float fat_shares[] = {1.0f / 16, 1.0f / 8};

// Fat boxes are made where boxes would stay in them for so many frames. They were made in vain if
// they served fewer than half as many.
constexpr int least_service = 4;

// Queries.

// What it costs to build a tree, for each of its geoms, in units of what a query without a tree
// pays for a geom, about 4 ns.
constexpr double build_cost = 12;

// The same to bring it up to date, for each geom that changed; a row of sixteen strays costs a
// query 1. Changes are noted one by one while that costs less than going through all geoms.
constexpr double refresh_cost = 4;

// Hits are marked rather than sorted if they are this part of all slots, but for a few.
constexpr std::size_t many_hits = 1024, few_hits = 16;

// The bounds of a cell grow with a box that moves while they are no longer than so many lengths of
// the box. With half as many, frames of 30,000 boxes, a tenth of them moving, took 1.25 times the
// instructions, with 10 as many as now.
constexpr int cell_lengths = 6;

// Decisions.

// Up to this number of slots brute force is as fast as the sweep on one thread.
constexpr std::size_t brute_force_slots = 200;

// Up to this number if the last frame had more than a sixteenth of all pairs. 300 boxes in one
// place took 0.53 of the sweep's time. Those that leave it take 1.6 times as long in one frame;
// 1,000 would take 2.2 times as long.
constexpr std::size_t crowded_slots = 500, crowded_share = 32;

// Up to this number of geoms pairs of a small scene are tested without vectors.
constexpr unsigned most_without_vectors = 32;

// A near callback that takes so long for a pair reads geoms that are not in the cache: one that
// counts takes 2 to 3 ns, one that reads bodies and user data 14 ns among 1,000 geoms, 27 among
// 10,000, 80 to 150 from 100,000 on. In a scene of many geoms it need not read all from memory: the
// whole frame of 100,000 took 0.9 of the time on one thread and 0.8 to 0.93 on 16, that of 40,000
// 0.94 and 0.81, but that of 10,000 1.02 and of 1,000 1.07.
constexpr double least_callback_ms = 2e-5, least_callback_ms_of_many = 8e-6;
constexpr std::size_t many_geoms = std::size_t{1} << 15;

// The part of what is known of a back end's time that its newest frame makes up.
constexpr double newest_weight = 0.25;

// The same while it is tried.
constexpr double trial_weight = 0.7;

// A change of back ends must take less than this part of the time.
constexpr double hysteresis = 0.95;

// A back end that lost is tried again if it would take no more than so many times as long.
constexpr double worth_another_try = 2;

// Time that devices would have saved a space before their driver is loaded, which takes up to a
// second of another thread's time.
constexpr double least_missed_ms = 50;

// The work that is worth a thread: 10 us to 0.3 ms on one core (AMD EPYC, GCC 12). A team of two
// takes about 2 us to start while its threads still spin, 10 to 50 us once they sleep.
namespace grains {

// Slots that are swept, up to 4,096 of them by one thread in any case, in 0.4 ms.
constexpr Grain scene = {1024, Grain::further, 4096};
constexpr Grain slots = {1024, Grain::further};  // whose geoms are read
constexpr Grain items = {1024, Grain::whole};    // pairs for the program, slots for sorts
constexpr Grain cells = {256, Grain::whole};     // of sixteen boxes, or words of 64 slots
// Boxes that meet trees of all others, in 1 to 2 us each. With 512, 1 % of 100,000 boxes took two
// of 16 threads, and extraction 1.7 times as long.
constexpr Grain changed_boxes = {64, Grain::further};
constexpr Grain box_tests = {1 << 18, Grain::further};  // of two boxes, by brute force
constexpr Grain tested_pairs = {8192, Grain::further};
constexpr Grain moved_pairs = {8192, Grain::whole};  // sorted, or copied to another list
constexpr Grain collided_pairs = {256, Grain::whole};
constexpr Grain heavy_pairs = {8, Grain::whole};  // of slow colliders
constexpr Grain cast_rays = {64, Grain::whole};   // for their nearest hits

}  // namespace grains

// Counts in turns: frames in which the thing could have been done.
class BackOff {
 public:
  // Waits `first` turns after the first failure, twice as many after each further one, at most
  // back_off_range times as many.
  constexpr explicit BackOff(int first) : first_(first), next_(first) {}

  // A turn comes. Returns whether the thing is left out in it.
  bool skipTurn() { return left_ > 0 && left_-- > 0; }
  void failed() {
    left_ = next_;
    next_ = std::min(2 * next_, back_off_range * first_);
  }
  void paid() { next_ = first_; }

 private:
  int first_, next_, left_ = 0;
};

}  // namespace ode_parallel_sap
