#include "space/simd/lanes_avx2.h"
//
#include "space/simd/kernels_impl.h"

namespace ode_parallel_sap {

const KernelSet kernels_avx2 = kernel_set;

}  // namespace ode_parallel_sap
