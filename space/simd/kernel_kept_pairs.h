// Boxes against the larger ones that they had room in, and kept pairs of those against the boxes of
// now. Internal linkage, as in kernels_impl.h.
#pragma once

#include <string.h>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "space/base/box_set.h"
#include "space/base/pair_list.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/simd/kernels.h"
#include "space/simd/lanes_common.h"

namespace {

using namespace ode_parallel_sap;

// The six bounds of a box in twice four lanes, two of them twice, so that two loads have them all
// and read nothing beside the box. Upper bounds have their signs changed: of two boxes that
// overlap, or of which one contains the other, no lane is above a certain one of the other's.
#if defined(__AVX2__)
constexpr unsigned all_bounds = 0xff;

using Bounds = __m256;

inline Bounds boundsIn(const Box& box) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(box.lower)),
                              _mm_loadu_ps(box.lower + 2), 1);
}
inline Bounds movedBack(const Bounds& bounds, const Bounds& move) {
  return _mm256_sub_ps(bounds, move);
}
inline Bounds withSigns(const Bounds& bounds) {
  return _mm256_xor_ps(bounds, _mm256_setr_ps(0, 0, 0, -0.0f, 0, -0.0f, -0.0f, -0.0f));
}
inline Bounds limitsOf(const Box& box) {
  const __m256i other_side = _mm256_setr_epi32(5, 6, 7, 0, 7, 0, 1, 2);
  return withSigns(_mm256_permutevar8x32_ps(boundsIn(box), other_side));
}
// All bits where no bound is above its limit, or each is below it. NaN is neither.
inline unsigned notAbove(const Bounds& bounds, const Bounds& limits) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(bounds, limits, _CMP_LE_OQ)));
}
inline unsigned below(const Bounds& bounds, const Bounds& limits) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(bounds, limits, _CMP_LT_OQ)));
}
#else
constexpr unsigned all_bounds = 0xf;

using Four = float __attribute__((vector_size(16)));
using FourBits = std::int32_t __attribute__((vector_size(16)));

struct Bounds {
  Four front, back;
};

inline Bounds boundsIn(const Box& box) {
  Bounds bounds;
  memcpy(&bounds.front, box.lower, sizeof bounds.front);
  memcpy(&bounds.back, box.lower + 2, sizeof bounds.back);
  return bounds;
}
inline Bounds movedBack(const Bounds& bounds, const Bounds& move) {
  return {bounds.front - move.front, bounds.back - move.back};
}
inline Bounds withSigns(const Bounds& bounds) {
  const FourBits front = {0, 0, 0, INT32_MIN}, back = {0, INT32_MIN, INT32_MIN, INT32_MIN};
  return {reinterpret_cast<Four>(reinterpret_cast<FourBits>(bounds.front) ^ front),
          reinterpret_cast<Four>(reinterpret_cast<FourBits>(bounds.back) ^ back)};
}
inline Bounds limitsOf(const Box& box) {
  const Bounds bounds = boundsIn(box);
  Bounds other_side;
  pick<1, 2, 3, 4>(bounds.back, bounds.front, &other_side.front);
  pick<3, 4, 5, 6>(bounds.back, bounds.front, &other_side.back);
  return withSigns(other_side);
}
inline unsigned lanesOf(const FourBits& both) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(both)));
#else
  std::uint64_t halves[2];
  memcpy(halves, &both, sizeof halves);
  return (halves[0] & halves[1]) == ~std::uint64_t{0} ? all_bounds : 0;
#endif
}
// All bits where no bound is above its limit, or each is below it. NaN is neither.
inline unsigned notAbove(const Bounds& bounds, const Bounds& limits) {
  return lanesOf((bounds.front <= limits.front) & (bounds.back <= limits.back));
}
inline unsigned below(const Bounds& bounds, const Bounds& limits) {
  return lanesOf((bounds.front < limits.front) & (bounds.back < limits.back));
}
#endif
inline Bounds boundsOf(const Box& box) {
  return withSigns(boundsIn(box));
}

inline std::uint64_t boxesOutside(const Box* boxes, const Box& move, const Box* room,
                                  std::size_t count) {
  const Bounds all_moved = boundsIn(move);
  std::uint64_t outside = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Bounds bounds = withSigns(movedBack(boundsIn(boxes[i]), all_moved));
    const bool inside = notAbove(boundsOf(room[i]), bounds) == all_bounds;
    outside |= std::uint64_t{!inside && isActive(boxes[i])} << i;
  }
  return outside;
}

inline bool keptPairs(const Box* boxes, const std::uint64_t* kept, std::size_t count, bool exact,
                      std::uint64_t*& end) {
  std::uint64_t* next = end;
  bool any_borderline = false;
  const auto test = [&](std::uint64_t pair) {
    const Bounds limits = limitsOf(boxes[earlierOf(pair)]);
    const Bounds other = boundsOf(boxes[laterOf(pair)]);
    const unsigned hits = notAbove(other, limits);
    *next = pair;
    if (!exact && __builtin_expect(hits != below(other, limits), false)) {
      *next |= borderline_bit;
      any_borderline = true;
    }
    next += hits == all_bounds;
  };
  std::size_t i = 0;
  for (; i + prefetch_distance < count; ++i) {
    prefetch(&boxes[laterOf(kept[i + prefetch_distance])]);
    test(kept[i]);
  }
  for (; i < count; ++i) test(kept[i]);
  end = next;
  return any_borderline;
}

}  // namespace
