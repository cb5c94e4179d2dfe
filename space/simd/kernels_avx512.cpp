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
  // The numbers repeat after sixteen. An unaligned load would wait for two stores.
  static __m512 further(const float* p, unsigned by) {
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    return _mm512_permutexvar_ps(_mm512_add_epi32(lanes, _mm512_set1_epi32(static_cast<int>(by))),
                                 load(p));
  }
  static std::uint32_t belowAndZero(const float* p) {
    const __m512 v = _mm512_load_ps(p), zero = _mm512_setzero_ps();
    return _mm512_cmp_ps_mask(v, zero, _CMP_LT_OQ) | std::uint32_t{_mm512_cmpeq_ps_mask(v, zero)}
                                                         << 16;
  }
  using RegisterLanes::compress;
  template <int rows>
  static void compress(const float* p, std::size_t stride, unsigned mask, float* out,
                       std::size_t out_stride) {
    for (int row = 0; row < rows; ++row)
      store(_mm512_load_si512(p + row * stride), mask,
            reinterpret_cast<std::uint32_t*>(out + row * out_stride));
  }
  static std::size_t writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    store(_mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(first)), lanes), mask, out);
    return __builtin_popcount(mask);
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

#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_avx512 = kernel_set;
