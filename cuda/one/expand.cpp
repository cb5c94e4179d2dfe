#include "cuda/one/expand.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace ode_parallel_sap {

using namespace device;

namespace {

Pair pairOf(std::uint32_t earlier, std::uint32_t word) {
  return (std::uint64_t{word} & 1) << 63 | std::uint64_t{earlier} << 32 | (word & word_mask) >> 1;
}

// The first slot after `slot` that has a list; there is one.
std::uint32_t nextWithList(const std::uint32_t* has_list, std::uint32_t slot) {
  ++slot;
  std::uint32_t left = has_list[slot / 32] >> slot % 32;
  if (left) return slot + __builtin_ctz(left);
  std::size_t place = slot / 32 + 1;
  while (!has_list[place]) ++place;
  return static_cast<std::uint32_t>(place * 32 + __builtin_ctz(has_list[place]));
}

// Word by word. `slot` is that of the word before, and becomes that of the last one.
void expandSlowly(const std::uint32_t* words, std::size_t count, const std::uint32_t* has_list,
                  std::uint32_t& slot, Pair* pairs) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t ahead = words[i] >> ahead_shift;
    slot = ahead == far_ahead ? nextWithList(has_list, slot) : slot + ahead;
    pairs[i] = pairOf(slot, words[i]);
  }
}

#if defined(__SSE2__)
// Four words at a time: their slots are a running sum. Nothing here branches on how long lists are,
// which nobody could precompute.
void expandFours(const std::uint32_t* words, std::size_t count, const std::uint32_t* has_list,
                 std::uint32_t slot, Pair* pairs) {
  const __m128i far = _mm_set1_epi32(far_ahead);
  __m128i slots = _mm_set1_epi32(static_cast<int>(slot));
  for (std::size_t i = 0; i < count; i += 4) {
    const __m128i word = _mm_load_si128(reinterpret_cast<const __m128i*>(words + i));
    __m128i ahead = _mm_srli_epi32(word, ahead_shift);
    if (_mm_movemask_epi8(_mm_cmpeq_epi32(ahead, far))) {
      slot = static_cast<std::uint32_t>(_mm_cvtsi128_si32(slots));
      expandSlowly(words + i, 4, has_list, slot, pairs + i);
      slots = _mm_set1_epi32(static_cast<int>(slot));
      continue;
    }
    ahead = _mm_add_epi32(ahead, _mm_slli_si128(ahead, 4));
    ahead = _mm_add_epi32(ahead, _mm_slli_si128(ahead, 8));
    slots = _mm_add_epi32(slots, ahead);
    const __m128i low = _mm_srli_epi32(_mm_slli_epi32(word, 32 - ahead_shift), 33 - ahead_shift);
    const __m128i high = _mm_or_si128(slots, _mm_slli_epi32(word, 31));
    __m128i* const to = reinterpret_cast<__m128i*>(pairs + i);
    _mm_store_si128(to, _mm_unpacklo_epi32(low, high));
    _mm_store_si128(to + 1, _mm_unpackhi_epi32(low, high));
    slots = _mm_shuffle_epi32(slots, 0xff);
  }
}
#endif

}  // namespace

bool expandSegment(const std::uint32_t* segment, std::size_t words, const std::uint32_t* has_list,
                   Pair* pairs) {
  const std::uint32_t* const first = segment + header_words;
  std::uint32_t all = 0;
  for (std::size_t i = 0; i < words; ++i) all |= first[i];
  std::uint32_t slot = segment[0];
  pairs[0] = pairOf(slot, first[0]);  // whatever it says of the word before
#if defined(__SSE2__)
  if (words >= 8) {
    const std::size_t fours = words / 4 * 4;
    std::uint32_t last = slot;
    expandSlowly(first + 1, 3, has_list, last, pairs + 1);
    expandFours(first + 4, fours - 4, has_list, last, pairs + 4);
    // The slot of the last word of a four, for what is left.
    slot = earlierOf(pairs[fours - 1]);
    expandSlowly(first + fours, words - fours, has_list, slot, pairs + fours);
    return all & 1;
  }
#endif
  expandSlowly(first + 1, words - 1, has_list, slot, pairs + 1);
  return all & 1;
}

}  // namespace ode_parallel_sap
