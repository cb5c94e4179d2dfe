// Sixteen lanes as four SSE2 registers: every x86-64 processor.
#include <emmintrin.h>

#include "space/simd/lanes_common.h"

namespace {

struct Lanes : RegisterLanes<Lanes> {
  static constexpr const char* name = "sse2";

  static unsigned signs(Mask<float> v) {
    return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(v)));
  }
  static unsigned signs(Mask<double> v) {
    return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(v)));
  }
  // Numbers that become bytes keep their signs, and zero. NaN that a program makes has none.
  static std::uint32_t belowAndZero(const float* p) {
    const auto words = [=](int i) { return reinterpret_cast<__m128i>(load(p + i)); };
    const __m128i bytes =
        _mm_packs_epi16(_mm_packs_epi32(words(0), words(4)), _mm_packs_epi32(words(8), words(12)));
    return static_cast<std::uint32_t>(_mm_movemask_epi8(bytes)) |
           static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_cmpeq_epi8(bytes, _mm_setzero_si128())))
               << 16;
  }
};

}  // namespace

#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_sse2 = kernel_set;
