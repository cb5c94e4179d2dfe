// Sixteen lanes in plain C++, for processors without one of the other sets.
#include "space/simd/lanes_common.h"

namespace {

struct Lanes : RegisterLanes<Lanes> {
  static constexpr const char* name = "portable";

  template <class Mask>
  static unsigned signs(const Mask& mask) {
    constexpr int lanes = sizeof mask / sizeof mask[0];
    unsigned bits = 0;
    for (int i = 0; i < lanes; ++i) bits |= unsigned{mask[i] != 0} << i;
    return bits;
  }
};

}  // namespace

#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_portable = kernel_set;
