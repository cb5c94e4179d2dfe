// Pairs of boxes of which dCollide certainly finds no contact, found without it. Sees ODE's private
// headers in its source only.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {

// fixed: as many pairs as are tested at a time, a bit of a word each.
constexpr std::size_t most_apart_pairs = 32;

// Pairs by bits.
struct ApartBoxes {
  std::uint32_t tested;
  std::uint32_t apart;  // of those, pairs of which dCollide returns 0

  std::size_t count() const { return static_cast<std::size_t>(__builtin_popcount(apart)); }
};

// Tests those pairs [0, count) of two boxes that are in `wanted`, for which dCollide is called
// without CONTACTS_UNIMPORTANT: with it ODE's collider of boxes does not look along all axes. A
// pose that dCollide would have to bring up to date first leaves its pair untested.
//
// What ODE's collider (0.16) decides by its own computations is what counts, not the shapes:
// `apart` holds what it finds apart whatever the errors of rounding are, its and those made here,
// in every rounding mode, with denormals flushed or not, and whatever numbers poses, sizes and
// matrices hold. It takes the rest for one that might touch.
ApartBoxes certainlyApart(const dParallelSAPPair* pairs, std::size_t count, std::uint32_t wanted);

}  // namespace ode_parallel_sap
