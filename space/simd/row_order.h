// A row put in order. Internal linkage, as in kernels_impl.h.
#pragma once

#include <cstddef>
#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace {

#if defined(__AVX2__)
// Sorting networks on eight words of a register. `Order` shuffles them to their partners; the lanes
// in `blend` get the greater of both.
struct EightWords {
  template <int blend>
  static __m256i ordered(__m256i words, __m256i partners) {
    return _mm256_blend_epi32(_mm256_min_epu32(words, partners), _mm256_max_epu32(words, partners),
                              blend);
  }
  static __m256i reversed(__m256i words) {
    return _mm256_permutevar8x32_epi32(words, _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0));
  }
  // Of words that rise and then fall.
  static __m256i merged(__m256i words) {
    words = ordered<0xf0>(words, _mm256_permute4x64_epi64(words, 0x4e));
    words = ordered<0xcc>(words, _mm256_shuffle_epi32(words, 0x4e));
    return ordered<0xaa>(words, _mm256_shuffle_epi32(words, 0xb1));
  }
  // Of any: runs of two, four and eight.
  static __m256i sorted(__m256i words) {
    words = ordered<0xaa>(words, _mm256_shuffle_epi32(words, 0xb1));
    words = ordered<0xcc>(words, _mm256_shuffle_epi32(words, 0x1b));
    words = ordered<0xaa>(words, _mm256_shuffle_epi32(words, 0xb1));
    words = ordered<0xf0>(words, reversed(words));
    words = ordered<0xcc>(words, _mm256_shuffle_epi32(words, 0x4e));
    return ordered<0xaa>(words, _mm256_shuffle_epi32(words, 0xb1));
  }
  // The first `count` of eight words, and the greatest unmarked one in place of the others.
  static __m256i sortedFew(const std::uint32_t* words, int count) {
    const __m256i beyond =
        _mm256_cmpgt_epi32(_mm256_setr_epi32(1, 2, 3, 4, 5, 6, 7, 8), _mm256_set1_epi32(count));
    return sorted(_mm256_blendv_epi8(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(words)),
                                     _mm256_set1_epi32(-2), beyond));
  }
};

// Sorts up to sixteen words into `to`, where sixteen are written. So many are read.
inline void orderFew(const std::uint32_t* row, std::size_t count, std::uint32_t* to) {
  using Eight = EightWords;
  __m256i* const out = reinterpret_cast<__m256i*>(to);
  const __m256i low = Eight::sortedFew(row, static_cast<int>(count));
  if (__builtin_expect(count <= 8, true)) {
    _mm256_storeu_si256(out, low);
    return;
  }
  const __m256i high = Eight::reversed(Eight::sortedFew(row + 8, static_cast<int>(count) - 8));
  _mm256_storeu_si256(out, Eight::merged(_mm256_min_epu32(low, high)));
  _mm256_storeu_si256(out + 1, Eight::merged(_mm256_max_epu32(low, high)));
}
#else
// Sorts up to sixteen words into `to`.
inline void orderFew(const std::uint32_t* row, std::size_t count, std::uint32_t* to) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t word = row[i];
    std::size_t at = i;
    for (; at > 0 && to[at - 1] > word; --at) to[at] = to[at - 1];
    to[at] = word;
  }
}
#endif

// Sorts any number of words, of which no two name one slot. Clears the marks it sets: a bit for
// each slot, and one for each 64 of these words.
inline void orderMany(const std::uint32_t* row, std::size_t count, std::uint64_t* marks,
                      std::uint64_t* marked_words, std::uint32_t* to) {
  std::uint32_t least = ~0u, most = 0;  // of the words of marks
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t slot = row[i] >> 1, word = slot / 64;
    marks[word] |= std::uint64_t{1} << slot % 64;
    marked_words[word / 64] |= std::uint64_t{1} << word % 64;
    least = word < least ? word : least;
    most = word > most ? word : most;
  }
  std::uint32_t* next = to;
  for (std::uint32_t above = least / 64; above <= most / 64; ++above) {
    for (std::uint64_t words = marked_words[above]; words; words &= words - 1) {
      const std::uint32_t word = above * 64 + static_cast<std::uint32_t>(__builtin_ctzll(words));
      for (std::uint64_t slots = marks[word]; slots; slots &= slots - 1)
        *next++ = 2 * (word * 64 + static_cast<std::uint32_t>(__builtin_ctzll(slots)));
      marks[word] = 0;
    }
    marked_words[above] = 0;
  }
  // The lowest bits were left behind.
  for (std::size_t i = 0; i < count; ++i) {
    if (!(row[i] & 1)) continue;
    std::size_t low = 0, high = count - 1;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (to[middle] < (row[i] & ~1u))
        low = middle + 1;
      else
        high = middle;
    }
    to[low] |= 1;
  }
}

}  // namespace
