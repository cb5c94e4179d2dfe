#include "lanes_avx2.h"
//
#include "kernels_impl.h"

namespace ode_parallel_sap {

extern const KernelSet kernels_avx2;
const KernelSet kernels_avx2 = kernel_set;

}  // namespace ode_parallel_sap
