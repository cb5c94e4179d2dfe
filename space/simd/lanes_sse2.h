// Sixteen lanes as four SSE2 registers: every x86-64 processor.
#pragma once

#include <emmintrin.h>

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"

namespace {

struct Lanes : RegisterLanes<Lanes> {
  static constexpr const char* name = "sse2";

  static __m128i load(const std::uint32_t* p) {
    return _mm_load_si128(reinterpret_cast<const __m128i*>(p));
  }
  static unsigned signs(__m128 v) { return static_cast<unsigned>(_mm_movemask_ps(v)); }
  static unsigned signs(__m128d v) { return static_cast<unsigned>(_mm_movemask_pd(v)); }
  static unsigned signs(__m128i v) { return signs(_mm_castsi128_ps(v)); }

  static __m128 notBelow(const float* p, float value) {
    return _mm_cmpge_ps(_mm_load_ps(p), _mm_set1_ps(value));
  }
  static __m128d notBelow(const double* p, double value) {
    return _mm_cmpge_pd(_mm_load_pd(p), _mm_set1_pd(value));
  }
  static __m128 notAbove(const float* p, float value) {
    return _mm_cmple_ps(_mm_load_ps(p), _mm_set1_ps(value));
  }
  static __m128d notAbove(const double* p, double value) {
    return _mm_cmple_pd(_mm_load_pd(p), _mm_set1_pd(value));
  }
  static __m128 both(__m128 a, __m128 b) { return _mm_and_ps(a, b); }
  static __m128d both(__m128d a, __m128d b) { return _mm_and_pd(a, b); }

  static unsigned sharesBits(const std::uint32_t* p, std::uint32_t value) {
    const __m128i v = _mm_set1_epi32(static_cast<int>(value));
    return 0xffff ^ bits<std::uint32_t>([=](int i) {
             return _mm_cmpeq_epi32(_mm_and_si128(load(p + i), v), _mm_setzero_si128());
           });
  }
  static unsigned below(const std::uint32_t* p, std::uint32_t value) {
    const __m128i v = _mm_set1_epi32(static_cast<int>(value));
    return bits<std::uint32_t>([=](int i) { return _mm_cmplt_epi32(load(p + i), v); });
  }
  static unsigned equals(const std::uint32_t* p, std::uint32_t value) {
    const __m128i v = _mm_set1_epi32(static_cast<int>(value));
    return bits<std::uint32_t>([=](int i) { return _mm_cmpeq_epi32(load(p + i), v); });
  }
};

}  // namespace
