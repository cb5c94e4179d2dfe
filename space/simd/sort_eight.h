// Short lists of pairs in order without a branch, for sets of lanes with AVX2. Internal linkage, as
// in kernels_impl.h.
#pragma once

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

namespace {

struct EightSorter {
  static constexpr std::size_t longest = 16;  // fixed: two registers

  // Writes the pairs of the first `count` of sixteen list words, ascending, to `sorted`. Words are
  // read, and places written, eight at a time: in the last eight anything is behind the pairs.
  static void sortShort(const std::uint32_t* words, std::size_t count, std::uint32_t earlier,
                        std::uint64_t* sorted) {
    if (count <= 8) {
      writeEight(sortedEight(firstOf(words, count)), earlier, sorted);
      return;
    }
    const __m256i low = sortedEight(firstOf(words, 8));
    const __m256i high = backwards(sortedEight(firstOf(words + 8, count - 8)));
    writeEight(merged(_mm256_min_epi32(low, high)), earlier, sorted);
    writeEight(merged(_mm256_max_epi32(low, high)), earlier, sorted + 8);
  }

 private:
  // Beyond `count` there are words that are above all.
  static __m256i firstOf(const std::uint32_t* words, std::size_t count) {
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256i used = _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lane);
    const __m256i v = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(words));
    return _mm256_blendv_epi8(_mm256_set1_epi32(0x7fffffff), v, used);
  }
  // The greater of both in the lanes of `greater`, the lesser in the others.
  template <int greater>
  static __m256i step(__m256i v, __m256i other) {
    return _mm256_blend_epi32(_mm256_min_epi32(v, other), _mm256_max_epi32(v, other), greater);
  }
  // A bitonic network, in which lanes are compared with those that they have been exchanged for.
  static __m256i sortedEight(__m256i v) {
    v = step<0xaa>(v, _mm256_shuffle_epi32(v, 0xb1));
    v = step<0xcc>(v, _mm256_shuffle_epi32(v, 0x1b));
    v = step<0xaa>(v, _mm256_shuffle_epi32(v, 0xb1));
    v = step<0xf0>(v, backwards(v));
    v = step<0xcc>(v, _mm256_shuffle_epi32(v, 0x4e));
    return step<0xaa>(v, _mm256_shuffle_epi32(v, 0xb1));
  }
  static __m256i backwards(__m256i v) {
    return _mm256_permute4x64_epi64(_mm256_shuffle_epi32(v, 0x1b), 0x4e);
  }
  // Of words that rise and fall, or fall and rise.
  static __m256i merged(__m256i v) {
    v = step<0xf0>(v, _mm256_permute4x64_epi64(v, 0x4e));
    v = step<0xcc>(v, _mm256_shuffle_epi32(v, 0x4e));
    return step<0xaa>(v, _mm256_shuffle_epi32(v, 0xb1));
  }
  static void writeEight(__m256i words, std::uint32_t earlier, std::uint64_t* pairs) {
    writeFour(_mm256_castsi256_si128(words), earlier, pairs);
    writeFour(_mm256_extracti128_si256(words, 1), earlier, pairs + 4);
  }
  static void writeFour(__m128i words, std::uint32_t earlier, std::uint64_t* pairs) {
    const __m256i wide = _mm256_cvtepu32_epi64(words);
    const __m256i mark = _mm256_slli_epi64(wide, 63), later = _mm256_srli_epi64(wide, 1);
    const __m256i upper = _mm256_set1_epi64x(static_cast<long long>(std::uint64_t{earlier} << 32));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(pairs),
                        _mm256_or_si256(_mm256_or_si256(mark, upper), later));
  }
};

}  // namespace
