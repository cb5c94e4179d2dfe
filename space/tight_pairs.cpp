#include "tight_pairs.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "floating_point.h"
#include "geom_tests.h"
#include "parallel.h"

namespace ode_parallel_sap {

namespace {

// What a thread takes at a time. A list that is not much longer is not worth a second one.
constexpr std::size_t chunk_pairs = std::size_t{1} << 15;

// Float bounds contain the exact ones, each by less than a step. So what does not overlap here does
// not, and what does by more than the steps of the bounds that meet surely does.
constexpr float steps = 1.0f / (1 << 21);
constexpr float least_step = 1e-40f;

#if defined(__SSE2__)
// Lanes 0 to 2; the fourth is a bound that belongs elsewhere.
struct Bounds {
  __m128 lower, upper;
  explicit Bounds(const Box& box)
      : lower(_mm_loadu_ps(box.lower)), upper(_mm_loadu_ps(box.lower + 2)) {
    upper = _mm_shuffle_ps(upper, upper, _MM_SHUFFLE(0, 3, 2, 1));
  }
};
constexpr int three_lanes = 7;

inline bool overlap(const Bounds& a, const Bounds& b) {
  const __m128 overlaps =
      _mm_and_ps(_mm_cmple_ps(a.lower, b.upper), _mm_cmple_ps(b.lower, a.upper));
  return (_mm_movemask_ps(overlaps) & three_lanes) == three_lanes;
}

// Where an upper bound is above a lower one beyond doubt. An infinite float stands for what lies
// further out than all others.
inline __m128 isClearlyAbove(__m128 lower, __m128 upper) {
  const __m128 sign = _mm_set1_ps(-0.0f), most = _mm_set1_ps(FLT_MAX), share = _mm_set1_ps(steps);
  lower = _mm_max_ps(lower, _mm_xor_ps(most, sign));
  upper = _mm_min_ps(upper, most);
  const __m128 doubt = _mm_add_ps(_mm_mul_ps(_mm_andnot_ps(sign, lower), share),
                                  _mm_mul_ps(_mm_andnot_ps(sign, upper), share));
  return _mm_cmpgt_ps(_mm_sub_ps(upper, lower), _mm_add_ps(doubt, _mm_set1_ps(least_step)));
}

inline bool overlapClearly(const Bounds& a, const Bounds& b) {
  const __m128 clear =
      _mm_and_ps(isClearlyAbove(a.lower, b.upper), isClearlyAbove(b.lower, a.upper));
  return (_mm_movemask_ps(clear) & three_lanes) == three_lanes;
}
#else
using Bounds = const Box&;

inline bool overlap(const Box& a, const Box& b) {
  bool overlaps = true;
  for (int axis = 0; axis < 3; ++axis)
    overlaps &= (a.lower[axis] <= b.upper[axis]) & (b.lower[axis] <= a.upper[axis]);
  return overlaps;
}

inline bool overlapClearly(const Box& a, const Box& b) {
  const auto clear = [](float lower, float upper) {
    lower = std::max(lower, -FLT_MAX);
    upper = std::min(upper, FLT_MAX);
    return upper - lower > std::fabs(lower) * steps + std::fabs(upper) * steps + least_step;
  };
  bool overlaps = true;
  for (int axis = 0; axis < 3; ++axis)
    overlaps &= clear(a.lower[axis], b.upper[axis]) & clear(b.lower[axis], a.upper[axis]);
  return overlaps;
}
#endif

// Copies the pairs of [begin, end) that stay to `to`, and returns their end.
template <bool exact>
Pair* selectChunk(dxGeom* const* geoms, const Box* boxes, const Pair* begin, const Pair* end,
                  Pair* to) {
  // Boxes of later slots lie anywhere.
  constexpr std::ptrdiff_t ahead = 32;
  for (const Pair* pair = begin; pair < end; ++pair) {
    const Box& soon = boxes[laterOf(end - pair > ahead ? pair[ahead] : *pair)];
    __builtin_prefetch(&soon.lower[0]);
    __builtin_prefetch(&soon.upper[2]);
    const Slot earlier = earlierOf(*pair), later = laterOf(*pair);
    const Bounds a(boxes[earlier]), b(boxes[later]);
    bool overlaps = overlap(a, b);
    // Which of the two comes next is a toss of a coin: one branch, seldom taken.
    if (!exact && __builtin_expect(overlaps & !overlapClearly(a, b), false))
      overlaps = boxesOverlap(geoms[earlier], geoms[later]);
    *to = *pair;
    to += overlaps;
  }
  return to;
}

}  // namespace

int TightPairs::select(dxGeom* const* geoms, const BoxSet& boxes, bool exact, const PairList& loose,
                       int threads, PairList& tight) {
  chunks_.clear();
  for (std::size_t part = 0; part < loose.parts.size(); ++part) {
    const std::size_t size = loose.parts[part].size();
    for (std::size_t begin = 0; begin < size; begin += chunk_pairs)
      chunks_.push_back({part, begin, std::min(begin + chunk_pairs, size)});
  }
  tight.clear(chunks_.size());
  const ScopedMode mode(exactMode());
  ChunkQueue queue(chunks_.size(), 1);
  int used = 1;
  runTeam(static_cast<int>(std::min<std::size_t>(threads, chunks_.size())), [&](int thread,
                                                                                int team) {
    if (thread == 0) used = team;
    Range range;
    while (queue.next(range)) {
      const PairList::Stretch& chunk = chunks_[range.begin];
      const Pair* const pairs = loose.parts[chunk.part].data();
      const Pair *const begin = pairs + chunk.begin, *const end = pairs + chunk.end;
      Buffer<Pair>& selected = tight.parts[range.begin];
      selected.resizeDiscarding(chunk.end - chunk.begin);
      Pair* const first = selected.data();
      Pair* const last = exact ? selectChunk<true>(geoms, boxes.tight.data(), begin, end, first)
                               : selectChunk<false>(geoms, boxes.tight.data(), begin, end, first);
      selected.resize(last - first);
    }
  });
  return used;
}

}  // namespace ode_parallel_sap
