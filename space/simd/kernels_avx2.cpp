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
  template <class T>
  static void compress(const T* p, unsigned mask, T* out) {
    static_assert(sizeof(T) == 4, "lanes are words");
    const auto eight = [](const T* from, unsigned m, T* to) {
      const __m256i lanes =
          _mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(load(from)), lanesOf(m));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), lanes);
    };
    eight(p, mask & 0xff, out);
    eight(p + 8, mask >> 8, out + __builtin_popcount(mask & 0xff));
  }
  static void compress(const double* p, unsigned mask, double* out) {
    RegisterLanes::compress(p, mask, out);
  }
  static void writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    const auto eight = [](std::uint32_t from, unsigned m, std::uint32_t* to) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                          _mm256_add_epi32(_mm256_set1_epi32(static_cast<int>(from)), lanesOf(m)));
    };
    eight(first, mask & 0xff, out);
    eight(first + 8, mask >> 8, out + __builtin_popcount(mask & 0xff));
  }
};

}  // namespace

// The kernels for these lanes.
#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_avx2 = kernel_set;
