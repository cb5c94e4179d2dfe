#include "space/simd/lanes_sse2.h"
//
#include "space/simd/kernels_impl.h"

namespace ode_parallel_sap {

const KernelSet kernels_sse2 = kernel_set;

}  // namespace ode_parallel_sap
