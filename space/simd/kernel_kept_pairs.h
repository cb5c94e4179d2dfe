// Boxes against the larger ones that they had room in, and kept pairs of those against the boxes of
// now. Internal linkage, as in kernels_impl.h.
#pragma once

#include <string.h>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "space/data/box_set.h"
#include "space/data/pair_list.h"
#include "space/data/tuning.h"
#include "space/simd/kernels.h"

namespace {

using namespace ode_parallel_sap;

// Four lanes, in whatever registers there are.
using Four = float __attribute__((vector_size(16)));
using FourBits = std::int32_t __attribute__((vector_size(16)));

// The six bounds of a box in eight lanes, two of them twice, so that two loads have them all and
// read nothing beside the box. Upper bounds have their signs changed: of two boxes that overlap, or
// of which one contains the other, no lane is above a certain one of the other's.
struct Bounds {
  Four front, back;
};

inline Bounds boundsOf(const Box& box) {
  FourBits front, back;
  memcpy(&front, box.lower, sizeof front);
  memcpy(&back, box.lower + 2, sizeof back);
  return {reinterpret_cast<Four>(front ^ FourBits{0, 0, 0, INT32_MIN}),
          reinterpret_cast<Four>(back ^ FourBits{0, INT32_MIN, INT32_MIN, INT32_MIN})};
}
// What the bounds of a box that overlaps this one are not above.
inline Bounds limitsOf(const Box& box) {
  const float *const lower = box.lower, *const upper = box.upper;
  return {Four{upper[0], upper[1], upper[2], -lower[0]},
          Four{upper[2], -lower[0], -lower[1], -lower[2]}};
}

// Two steps down in the order of all floats, as twoSteps() makes them.
inline Four twoStepsDown(Four values) {
  const FourBits bits = reinterpret_cast<FourBits>(values);
  FourBits sign = bits >> 31;
  const FourBits order = ((bits & 0x7fffffff) ^ sign) - sign - 2;
  sign = order >> 31;
  return reinterpret_cast<Four>(((order ^ sign) - sign) | (sign & INT32_MIN));
}

// Whether no lane is above the limit's. NaN is above all, and all is above it.
inline bool noneAbove(const Bounds& bounds, const Bounds& limits) {
  const FourBits within = (bounds.front <= limits.front) & (bounds.back <= limits.back);
#if defined(__SSE2__)
  return _mm_movemask_ps(reinterpret_cast<__m128>(within)) == 0xf;
#else
  std::uint64_t halves[2];
  memcpy(halves, &within, sizeof halves);
  return (halves[0] & halves[1]) == ~std::uint64_t{0};
#endif
}

// See Kernels.
inline std::uint64_t boxesOutside(const Box* boxes, const Box* room, std::size_t count) {
  std::uint64_t outside = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool inside = noneAbove(boundsOf(room[i]), boundsOf(boxes[i])) || !isActive(boxes[i]);
    outside |= std::uint64_t{!inside} << i;
  }
  return outside;
}

inline std::size_t keptPairs(const Box* boxes, const std::uint64_t* kept, std::size_t count,
                             bool exact, std::uint64_t* pairs) {
  std::uint64_t* next = pairs;
  Slot own = 0;
  Bounds limits = {}, sure = {};
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t pair = kept[i];
    __builtin_prefetch(
        &boxes[laterOf(kept[i + prefetch_distance < count ? i + prefetch_distance : i])]);
    if (earlierOf(pair) != own || i == 0) {
      own = earlierOf(pair);
      limits = limitsOf(boxes[own]);
      sure = limits;
      if (!exact) sure = {twoStepsDown(limits.front), twoStepsDown(limits.back)};
    }
    const Bounds other = boundsOf(boxes[laterOf(pair)]);
    *next = pair | std::uint64_t{!noneAbove(other, sure)} << 63;
    next += noneAbove(other, limits);
  }
  return static_cast<std::size_t>(next - pairs);
}

}  // namespace
