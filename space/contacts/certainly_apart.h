// Pairs of which dCollide certainly finds no contact, found without it. Sees ODE's private headers
// in its source only.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {

// fixed: as many pairs as are tested at a time, a bit of a word each.
constexpr std::size_t most_apart_pairs = 32;

// Two boxes are tested many times faster than dCollide finds them apart, other pairs not much.
struct ApartKinds {
  bool boxes;   // pairs of two boxes
  bool others;  // all others of spheres, capsules, boxes and planes
};

// Pairs by bits.
struct ApartPairs {
  std::uint32_t boxes, others;  // that were tested
  std::uint32_t apart;          // of those, pairs of which dCollide returns 0
};

// Tests those pairs [0, count) of these kinds that are in `wanted`, none of whose geoms is a space
// and for which dCollide is called without CONTACTS_UNIMPORTANT: with it ODE's collider of boxes
// does not look along all axes. Neither computes with poses that dCollide would have to bring up to
// date first.
//
// What ODE's colliders (0.16) decide by their own computations is what counts, not the shapes:
// `apart` holds what they find apart whatever the errors of rounding are, theirs and those made
// here, in every rounding mode, with denormals flushed or not, and whatever numbers poses, sizes
// and matrices hold. It takes the rest for one that might touch.
ApartPairs certainlyApart(const dParallelSAPPair* pairs, std::size_t count, std::uint32_t wanted,
                          ApartKinds kinds);

}  // namespace ode_parallel_sap
