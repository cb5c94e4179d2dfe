// The tuned constants of decisions.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// Up to this number of slots brute force is as fast as the sweep.
// Unit: slots. From: small, dense-cube on one thread.
constexpr std::size_t most_tested = 200;

// Up to this number of geoms pairs of a small scene are tested without vectors.
constexpr unsigned most_without_vectors = 32;

// A near callback that takes so long for a pair reads geoms that are not in the cache: one that
// counts takes 2 to 3 ns, one that reads bodies and user data 14 ns among 1,000 geoms, 27 among
// 10,000, 80 to 150 from 100,000 on.
constexpr double least_callback_ms = 2e-5;

// Testing which pairs of boxes are certainly apart pays where this part of them is.
// Unit: 1. From: contacts, piles.
// Doubled: +9 % of time. Halved: no difference.
constexpr double least_apart_boxes = 0.3;

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

}  // namespace ode_parallel_sap
