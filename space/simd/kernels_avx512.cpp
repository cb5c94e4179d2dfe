#include "lanes_avx512.h"
//
#include "kernels_impl.h"

namespace ode_parallel_sap {

extern const KernelSet kernels_avx512;
const KernelSet kernels_avx512 = kernel_set;

}  // namespace ode_parallel_sap
