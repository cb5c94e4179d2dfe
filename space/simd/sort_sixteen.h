// Short lists in order without a branch on what is in them, for sets of lanes with AVX-512 (VL).
// Internal linkage, as in kernels_impl.h.
#pragma once

#include "space/simd/sort_eight.h"

namespace {

// As EightSorter, with sixteen words in a register.
struct SixteenSorter {
  static constexpr std::size_t longest_sorted = 16;  // fixed: a register

  static void sortShort(const std::uint32_t* words, std::size_t count, std::uint32_t earlier,
                        std::uint64_t* sorted) {
    const unsigned used = (1u << count) - 1;
    if (count <= 8) {
      writeEight(sortEight(words, static_cast<__mmask8>(used)), earlier, sorted);
      return;
    }
    const __m512i v = sortSixteen(words, static_cast<__mmask16>(used));
    writeEight(_mm512_castsi512_si256(v), earlier, sorted);
    writeEight(_mm512_extracti32x8_epi32(v, 1), earlier, sorted + 8);
  }

 private:
  static __m256i sortEight(const std::uint32_t* words, __mmask8 used) {
    return sortedEight<Step>(_mm256_mask_loadu_epi32(_mm256_set1_epi32(-1), used, words));
  }
  static __m512i sortSixteen(const std::uint32_t* words, __mmask16 used) {
    __m512i v = _mm512_mask_loadu_epi32(_mm512_set1_epi32(-1), used, words);
    v = Step::of<0xaaaa>(v, quarters<0xb1>(v));
    v = Step::of<0xcccc>(v, quarters<0x1b>(v));
    v = Step::of<0xaaaa>(v, quarters<0xb1>(v));
    v = Step::of<0xf0f0>(v, exchanged<0xb1>(quarters<0x1b>(v)));
    v = Step::of<0xcccc>(v, quarters<0x4e>(v));
    v = Step::of<0xaaaa>(v, quarters<0xb1>(v));
    v = Step::of<0xff00>(v, exchanged<0x1b>(quarters<0x1b>(v)));
    v = Step::of<0xf0f0>(v, exchanged<0xb1>(v));
    v = Step::of<0xcccc>(v, quarters<0x4e>(v));
    return Step::of<0xaaaa>(v, quarters<0xb1>(v));
  }
  template <int places>
  static __m512i quarters(__m512i v) {
    return _mm512_shuffle_epi32(v, static_cast<_MM_PERM_ENUM>(places));
  }
  template <int quarters>
  static __m512i exchanged(__m512i v) {
    return _mm512_shuffle_i32x4(v, v, quarters);
  }
  struct Step {
    template <unsigned greater>
    static __m256i of(__m256i v, __m256i other) {
      return _mm256_mask_max_epu32(_mm256_min_epu32(v, other), greater, v, other);
    }
    template <unsigned greater>
    static __m512i of(__m512i v, __m512i other) {
      return _mm512_mask_max_epu32(_mm512_min_epu32(v, other), greater, v, other);
    }
  };
  static void writeEight(__m256i words, std::uint32_t earlier, std::uint64_t* pairs) {
    const __m512i wide = _mm512_cvtepu32_epi64(words);
    const __m512i mark = _mm512_slli_epi64(wide, 63), later = _mm512_srli_epi64(wide, 1);
    const __m512i upper = _mm512_set1_epi64(static_cast<long long>(std::uint64_t{earlier} << 32));
    _mm512_storeu_si512(pairs, _mm512_or_si512(_mm512_or_si512(mark, upper), later));
  }
};

}  // namespace
