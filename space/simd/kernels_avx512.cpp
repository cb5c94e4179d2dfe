// Sixteen lanes as one AVX-512 register (F, DQ, VL).
#include <immintrin.h>
#include <string.h>

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"

namespace {

struct Lanes : RegisterLanes<Lanes> {
  static constexpr const char* name = "avx512";

  static unsigned signs(Mask<float> v) {
    return _mm512_movepi32_mask(reinterpret_cast<__m512i>(v));
  }
  static unsigned signs(Mask<double> v) {
    return _mm512_movepi64_mask(reinterpret_cast<__m512i>(v));
  }
  // A comparison that is made often need not fill a register first.
  static unsigned below(const std::uint32_t* p, std::uint32_t value) {
    return _mm512_cmplt_epi32_mask(_mm512_load_si512(p),
                                   _mm512_set1_epi32(static_cast<int>(value)));
  }
  // As in RegisterLanes.
  template <class BoxGroup, class Allowed>
  static int meetBoxes(const BoxGroup& own, unsigned lane, const BoxGroup& boxes, Allowed allowed,
                       std::uint32_t* row) {
    __m512 gaps[3];
    for (int axis = 0; axis < 3; ++axis)
      gaps[axis] = _mm512_max_ps(
          _mm512_sub_ps(_mm512_load_ps(boxes.lower[axis]), _mm512_set1_ps(own.upper[axis][lane])),
          _mm512_sub_ps(_mm512_set1_ps(own.lower[axis][lane]), _mm512_load_ps(boxes.upper[axis])));
    const __m512 gap = _mm512_max_ps(_mm512_max_ps(gaps[0], gaps[1]), gaps[2]);
    const __m512 zero = _mm512_setzero_ps();
    const __m512i slots = _mm512_load_si512(boxes.slot), twice = _mm512_add_epi32(slots, slots);
    const __m512i words =
        _mm512_mask_or_epi32(twice, _mm512_cmpeq_ps_mask(gap, zero), twice, _mm512_set1_epi32(1));
    const unsigned hits = allowed(_mm512_cmp_ps_mask(gap, zero, _CMP_LE_OQ));
    store(words, hits, row);
    return __builtin_popcount(hits);
  }
  template <class T>
  static void compress(const T* p, unsigned mask, T* out) {
    static_assert(sizeof(T) == 4, "lanes are words");
    store(_mm512_load_si512(p), mask, reinterpret_cast<std::uint32_t*>(out));
  }
  static void compress(const double* p, unsigned mask, double* out) {
    const __mmask8 low = static_cast<__mmask8>(mask & 0xff),
                   high = static_cast<__mmask8>(mask >> 8);
    _mm512_storeu_pd(out, _mm512_maskz_compress_pd(low, _mm512_load_pd(p)));
    _mm512_storeu_pd(out + __builtin_popcount(low),
                     _mm512_maskz_compress_pd(high, _mm512_load_pd(p + 8)));
  }
  static void writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    store(_mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(first)), lanes), mask, out);
  }

 private:
  // Stores those in `mask`, side by side. Compressing to memory directly is far slower on some
  // processors, and few are stored at a time: half a register is seldom across two lines of the
  // cache.
  static void store(__m512i words, unsigned mask, std::uint32_t* out) {
    const __m512i packed = _mm512_maskz_compress_epi32(static_cast<__mmask16>(mask), words);
    memcpy(out, &packed, sizeof packed / 2);
    if (__builtin_expect(__builtin_popcount(mask) > 8, false))
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(out) + 1,
                          _mm512_maskz_extracti64x4_epi64(0xf, packed, 1));
  }
};

// Sixteen boxes in registers.
template <>
template <>
struct RegisterLanes<Lanes>::Sixteen<float> {
  __m512 lower[3], upper[3];

  Sixteen(const float* lowers, const float* uppers, std::size_t stride) {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = _mm512_load_ps(lowers + axis * stride);
      upper[axis] = _mm512_load_ps(uppers + axis * stride);
    }
  }
  // Which of them overlap a box, as closed intervals.
  template <class BoxGroup>
  unsigned overlapping(const BoxGroup& box, unsigned lane) const {
    __mmask16 mask = 0xffff;
    for (int axis = 0; axis < 3; ++axis) {
      mask = _mm512_mask_cmp_ps_mask(mask, upper[axis], _mm512_set1_ps(box.lower[axis][lane]),
                                     _CMP_GE_OQ);
      mask = _mm512_mask_cmp_ps_mask(mask, lower[axis], _mm512_set1_ps(box.upper[axis][lane]),
                                     _CMP_LE_OQ);
    }
    return mask;
  }
};

}  // namespace

// The kernels for these lanes.
#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_avx512 = kernel_set;
