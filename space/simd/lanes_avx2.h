// Sixteen lanes as two AVX2 registers.
#pragma once

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"
#include "space/simd/sort_eight.h"

namespace {

// compress_order[m] lists the set bits of m, low ones first.
struct CompressOrder {
  alignas(32) std::uint32_t lanes[256][8];
  constexpr CompressOrder() : lanes() {
    for (int m = 0; m < 256; ++m) {
      int count = 0;
      for (int i = 0; i < 8; ++i)
        if (m >> i & 1) lanes[m][count++] = i;
    }
  }
};
constexpr CompressOrder compress_order;

struct Lanes : ScalarLanes, EightSorter {
  static constexpr const char* name = "avx2";
  using EightSorter::longest_sorted;

  template <class Test>
  static unsigned each(Test test) {
    return test(0) | test(8) << 8;
  }
  static __m256i load(const std::uint32_t* p) {
    return _mm256_load_si256(reinterpret_cast<const __m256i*>(p));
  }
  static unsigned signs(__m256 v) { return static_cast<unsigned>(_mm256_movemask_ps(v)); }

  static unsigned atLeast(const float* p, float value) {
    const __m256 v = _mm256_set1_ps(value);
    return each([=](int i) { return signs(_mm256_cmp_ps(_mm256_load_ps(p + i), v, _CMP_GE_OQ)); });
  }
  static unsigned atMost(const float* p, float value) {
    const __m256 v = _mm256_set1_ps(value);
    return each([=](int i) { return signs(_mm256_cmp_ps(_mm256_load_ps(p + i), v, _CMP_LE_OQ)); });
  }
  static unsigned atLeast(const double* p, double value) {
    const __m256d v = _mm256_set1_pd(value);
    unsigned mask = 0;
    for (int i = 0; i < 16; i += 4)
      mask |= static_cast<unsigned>(
                  _mm256_movemask_pd(_mm256_cmp_pd(_mm256_load_pd(p + i), v, _CMP_GE_OQ)))
              << i;
    return mask;
  }
  static unsigned atMost(const double* p, double value) {
    const __m256d v = _mm256_set1_pd(value);
    unsigned mask = 0;
    for (int i = 0; i < 16; i += 4)
      mask |= static_cast<unsigned>(
                  _mm256_movemask_pd(_mm256_cmp_pd(_mm256_load_pd(p + i), v, _CMP_LE_OQ)))
              << i;
    return mask;
  }
  template <class Real>
  using Row = RowByPointer<Lanes, Real>;

  static unsigned sharesBits(const std::uint32_t* p, std::uint32_t value) {
    const __m256i v = _mm256_set1_epi32(static_cast<int>(value));
    return 0xffff ^ each([=](int i) {
             return signs(_mm256_castsi256_ps(
                 _mm256_cmpeq_epi32(_mm256_and_si256(load(p + i), v), _mm256_setzero_si256())));
           });
  }
  static unsigned below(const std::uint32_t* p, std::uint32_t value) {
    const __m256i v = _mm256_set1_epi32(static_cast<int>(value));
    return each(
        [=](int i) { return signs(_mm256_castsi256_ps(_mm256_cmpgt_epi32(v, load(p + i)))); });
  }
  static unsigned equals(const std::uint32_t* p, std::uint32_t value) {
    const __m256i v = _mm256_set1_epi32(static_cast<int>(value));
    return each(
        [=](int i) { return signs(_mm256_castsi256_ps(_mm256_cmpeq_epi32(load(p + i), v))); });
  }
  template <class T>
  static void compress(const T* p, unsigned mask, T* out) {
    static_assert(sizeof(T) == 4, "lanes are words");
    const auto eight = [](const T* from, unsigned m, T* to) {
      const __m256i lanes = _mm256_permutevar8x32_epi32(
          _mm256_load_si256(reinterpret_cast<const __m256i*>(from)), load(compress_order.lanes[m]));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), lanes);
    };
    eight(p, mask & 0xff, out);
    eight(p + 8, mask >> 8, out + __builtin_popcount(mask & 0xff));
  }
  static void compress(const double* p, unsigned mask, double* out) {
    ScalarLanes::compress(p, mask, out);
  }
  static void writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    const auto eight = [](std::uint32_t from, unsigned m, std::uint32_t* to) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                          _mm256_add_epi32(_mm256_set1_epi32(static_cast<int>(from)),
                                           load(compress_order.lanes[m])));
    };
    eight(first, mask & 0xff, out);
    eight(first + 8, mask >> 8, out + __builtin_popcount(mask & 0xff));
  }
  static int writePairs(const std::uint32_t* slots, std::uint32_t slot, unsigned mask,
                        std::uint64_t* out) {
    const int low = writeEight(slots, slot, mask & 0xff, out);
    if (!(mask >> 8)) return low;
    return low + writeEight(slots + 8, slot, mask >> 8, out + low);
  }
  using ScalarLanes::greatest;
  using ScalarLanes::least;
  static float least(const float* p) {
    __m256 v = min(_mm256_load_ps(p), _mm256_load_ps(p + 8));
    v = min(v, _mm256_permute2f128_ps(v, v, 1));
    v = min(v, _mm256_permute_ps(v, 0x4e));
    v = min(v, _mm256_permute_ps(v, 0xb1));
    return _mm256_cvtss_f32(v);
  }
  static float greatest(const float* p) {
    __m256 v = max(_mm256_load_ps(p), _mm256_load_ps(p + 8));
    v = max(v, _mm256_permute2f128_ps(v, v, 1));
    v = max(v, _mm256_permute_ps(v, 0x4e));
    v = max(v, _mm256_permute_ps(v, 0xb1));
    return _mm256_cvtss_f32(v);
  }

 private:
  // Writes eight words, of which as many count as `mask` has bits.
  static int writeEight(const std::uint32_t* slots, std::uint32_t slot, unsigned mask,
                        std::uint64_t* out) {
    const __m256i own = _mm256_set1_epi32(static_cast<int>(slot));
    const __m256i other =
        _mm256_permutevar8x32_epi32(load(slots), load(compress_order.lanes[mask]));
    const __m256i earlier = _mm256_min_epu32(own, other);
    const __m256i later = _mm256_max_epu32(own, other);
    const auto word = [](__m128i high, __m128i low) {
      return _mm256_or_si256(_mm256_slli_epi64(_mm256_cvtepu32_epi64(high), 32),
                             _mm256_cvtepu32_epi64(low));
    };
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out),
                        word(_mm256_castsi256_si128(earlier), _mm256_castsi256_si128(later)));
    _mm256_storeu_si256(
        reinterpret_cast<__m256i*>(out + 4),
        word(_mm256_extracti128_si256(earlier, 1), _mm256_extracti128_si256(later, 1)));
    return __builtin_popcount(mask);
  }
  // The lesser of both, or the other one where one is NaN.
  static __m256 min(__m256 a, __m256 b) {
    return _mm256_blendv_ps(_mm256_min_ps(a, b), a, _mm256_cmp_ps(b, b, _CMP_UNORD_Q));
  }
  static __m256 max(__m256 a, __m256 b) {
    return _mm256_blendv_ps(_mm256_max_ps(a, b), a, _mm256_cmp_ps(b, b, _CMP_UNORD_Q));
  }
};

}  // namespace
