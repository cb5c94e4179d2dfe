// Sixteen lanes as four SSE2 registers: every x86-64 processor.
#pragma once

#include <emmintrin.h>

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"

namespace {

struct Lanes : ScalarLanes {
  static constexpr const char* name = "sse2";

  template <class Test>
  static unsigned each(Test test) {
    return test(0) | test(4) << 4 | test(8) << 8 | test(12) << 12;
  }
  static __m128i load(const std::uint32_t* p) {
    return _mm_load_si128(reinterpret_cast<const __m128i*>(p));
  }

  static unsigned atLeast(const float* p, float value) {
    const __m128 v = _mm_set1_ps(value);
    return each([=](int i) {
      return static_cast<unsigned>(_mm_movemask_ps(_mm_cmpge_ps(_mm_load_ps(p + i), v)));
    });
  }
  static unsigned atMost(const float* p, float value) {
    const __m128 v = _mm_set1_ps(value);
    return each([=](int i) {
      return static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(_mm_load_ps(p + i), v)));
    });
  }
  static unsigned atLeast(const double* p, double value) {
    const __m128d v = _mm_set1_pd(value);
    unsigned mask = 0;
    for (int i = 0; i < 16; i += 2)
      mask |= static_cast<unsigned>(_mm_movemask_pd(_mm_cmpge_pd(_mm_load_pd(p + i), v))) << i;
    return mask;
  }
  static unsigned atMost(const double* p, double value) {
    const __m128d v = _mm_set1_pd(value);
    unsigned mask = 0;
    for (int i = 0; i < 16; i += 2)
      mask |= static_cast<unsigned>(_mm_movemask_pd(_mm_cmple_pd(_mm_load_pd(p + i), v))) << i;
    return mask;
  }
  template <class Real>
  using Row = RowByRegisters<Lanes, Real>;
  static constexpr int doubles = 2;  // fixed: of a register

  // Which of the boxes of a register overlap a box.
  template <class BoxGroup>
  static unsigned overlapping(const float* lower, const float* upper, std::size_t stride,
                              const BoxGroup& box, unsigned lane) {
    const auto reach = [&](int axis) {
      return _mm_and_ps(
          _mm_cmpge_ps(_mm_load_ps(upper + axis * stride), _mm_set1_ps(box.lower[axis][lane])),
          _mm_cmple_ps(_mm_load_ps(lower + axis * stride), _mm_set1_ps(box.upper[axis][lane])));
    };
    return static_cast<unsigned>(
        _mm_movemask_ps(_mm_and_ps(_mm_and_ps(reach(0), reach(1)), reach(2))));
  }
  template <class BoxGroup>
  static unsigned overlapping(const double* lower, const double* upper, std::size_t stride,
                              const BoxGroup& box, unsigned lane) {
    const auto reach = [&](int axis) {
      return _mm_and_pd(
          _mm_cmpge_pd(_mm_load_pd(upper + axis * stride), _mm_set1_pd(box.lower[axis][lane])),
          _mm_cmple_pd(_mm_load_pd(lower + axis * stride), _mm_set1_pd(box.upper[axis][lane])));
    };
    return static_cast<unsigned>(
        _mm_movemask_pd(_mm_and_pd(_mm_and_pd(reach(0), reach(1)), reach(2))));
  }

  static unsigned sharesBits(const std::uint32_t* p, std::uint32_t value) {
    const __m128i v = _mm_set1_epi32(static_cast<int>(value));
    return 0xffff ^ each([=](int i) {
             const __m128i none =
                 _mm_cmpeq_epi32(_mm_and_si128(load(p + i), v), _mm_setzero_si128());
             return static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(none)));
           });
  }
  static unsigned below(const std::uint32_t* p, std::uint32_t value) {
    const __m128i v = _mm_set1_epi32(static_cast<int>(value));
    return each([=](int i) {
      return static_cast<unsigned>(
          _mm_movemask_ps(_mm_castsi128_ps(_mm_cmplt_epi32(load(p + i), v))));
    });
  }
  static unsigned equals(const std::uint32_t* p, std::uint32_t value) {
    const __m128i v = _mm_set1_epi32(static_cast<int>(value));
    return each([=](int i) {
      return static_cast<unsigned>(
          _mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(load(p + i), v))));
    });
  }
  using ScalarLanes::greatest;
  using ScalarLanes::least;
  // min and max return their second operand where one is NaN: NaN places come first.
  static float least(const float* p) {
    __m128 v = _mm_load_ps(p);
    for (int i = 4; i < 16; i += 4) v = min(v, _mm_load_ps(p + i));
    v = min(v, _mm_movehl_ps(v, v));
    v = min(v, _mm_shuffle_ps(v, v, 1));
    return _mm_cvtss_f32(v);
  }
  static float greatest(const float* p) {
    __m128 v = _mm_load_ps(p);
    for (int i = 4; i < 16; i += 4) v = max(v, _mm_load_ps(p + i));
    v = max(v, _mm_movehl_ps(v, v));
    v = max(v, _mm_shuffle_ps(v, v, 1));
    return _mm_cvtss_f32(v);
  }

 private:
  // The lesser of both, or the other one where one is NaN.
  static __m128 min(__m128 a, __m128 b) {
    const __m128 nan = _mm_cmpunord_ps(b, b);
    return _mm_or_ps(_mm_and_ps(nan, a), _mm_andnot_ps(nan, _mm_min_ps(a, b)));
  }
  static __m128 max(__m128 a, __m128 b) {
    const __m128 nan = _mm_cmpunord_ps(b, b);
    return _mm_or_ps(_mm_and_ps(nan, a), _mm_andnot_ps(nan, _mm_max_ps(a, b)));
  }
};

}  // namespace
