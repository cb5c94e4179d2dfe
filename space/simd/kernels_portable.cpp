#include "space/simd/lanes_portable.h"
//
#include "space/simd/kernels_impl.h"

namespace ode_parallel_sap {

const KernelSet kernels_portable = kernel_set;

}  // namespace ode_parallel_sap
