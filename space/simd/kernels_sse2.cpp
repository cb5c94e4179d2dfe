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
};

}  // namespace

// The kernels for these lanes.
#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_sse2 = kernel_set;
