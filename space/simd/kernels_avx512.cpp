#include "space/simd/lanes_avx512.h"
//
#include "space/simd/kernels_impl.h"

namespace ode_parallel_sap {

const KernelSet kernels_avx512 = kernel_set;

}  // namespace ode_parallel_sap
