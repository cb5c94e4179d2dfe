// The tuned constants of cells, and of sorting pairs.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// By how much cells may have grown on average, and the nodes above them, which grow alone where
// each cell is a swarm of its own.
constexpr double most_growth = 0.4;

// Cells that drift through each other without growing are found out only by cutting anew, after
// this many frames.
constexpr int longest_reuse = 32;

// The least that one thread sorts and cuts at a time. A round number: doubled or halved it makes no
// difference.
constexpr std::size_t least_piece_boxes = 512;

// What one thread sorts and cuts at a time: at most what the second-level cache holds with room to
// spare.
constexpr std::size_t most_piece_boxes = 8192;

// Digits of keys beyond those for about two boxes a key where boxes are spread evenly: these
// separate the boxes of a place that is thirty times as clustered.
constexpr int digits_for_clusters = 5;

// Boxes that decide on classes: enough to see a kind that is one in a few hundred.
constexpr std::size_t sampled_boxes = 1024;

// An axis divides boxes into short and long ones if these are this many times as long on average.
constexpr double far_longer = 8;

// Binary digits that records are dealt by at a time: 2,048 counters and open cache lines stay
// within the second-level cache.
constexpr int most_digits = 11;

// The same on one thread, whose counters are cleared for a few hundred records.
constexpr int most_digits_alone = 8;

// Pairs of a bucket, 64 kB: small beside the second-level cache.
constexpr std::size_t bucket_pairs = 8192;

// And at least so many where there are buckets for all threads only.
constexpr std::size_t least_bucket_pairs = 512;

// One thread puts up to this number, of a quarter as many slots, in order at once: they still fit
// the cache.
constexpr std::size_t pairs_at_once = 65536;

}  // namespace ode_parallel_sap
