#include "space/simd/lanes_neon.h"
//
#include "space/simd/kernels_impl.h"

namespace ode_parallel_sap {

const KernelSet kernels_neon = kernel_set;

}  // namespace ode_parallel_sap
