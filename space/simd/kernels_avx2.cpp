// Sixteen lanes as two AVX2 registers.
#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"

namespace {

// For each mask of eight lanes its set bits, low ones first.
struct LaneTable {
  alignas(64) std::uint8_t lanes[256][8];
  constexpr LaneTable() : lanes() {
    for (int m = 0; m < 256; ++m)
      for (int i = 0, count = 0; i < 8; ++i)
        if (m >> i & 1) lanes[m][count++] = static_cast<std::uint8_t>(i);
  }
};
constexpr LaneTable compress_order;

struct Lanes : RegisterLanes<Lanes> {
  static constexpr const char* name = "avx2";

  static __m256i lanesOf(unsigned mask) {
    return _mm256_cvtepu8_epi32(
        _mm_loadl_epi64(reinterpret_cast<const __m128i*>(compress_order.lanes[mask])));
  }
  static unsigned signs(Mask<float> v) {
    return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(v)));
  }
  static unsigned signs(Mask<double> v) {
    return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(v)));
  }
  using RegisterLanes::compress;
  template <int rows>
  static void compress(const float* p, std::size_t stride, unsigned mask, float* out,
                       std::size_t out_stride) {
    const __m256i low = lanesOf(mask & 0xff), high = lanesOf(mask >> 8);
    const int count = __builtin_popcount(mask & 0xff);
    for (int row = 0; row < rows; ++row, p += stride, out += out_stride) {
      const __m256 a = _mm256_permutevar8x32_ps(load(p), low),
                   b = _mm256_permutevar8x32_ps(load(p + 8), high);
      _mm256_storeu_ps(out, a);
      _mm256_storeu_ps(out + count, b);
    }
  }
};

}  // namespace

#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_avx2 = kernel_set;
