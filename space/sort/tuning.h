// The tuned constants of sorting.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

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

// Lists of so many pairs on average are sorted one by one, in registers. Shorter and longer ones
// are sorted together, by digits.
constexpr std::size_t short_list = 2, long_list = 32;

}  // namespace ode_parallel_sap
