#include "lanes_neon.h"
//
#include "kernels_impl.h"

namespace ode_parallel_sap {

extern const KernelSet kernels_neon;
const KernelSet kernels_neon = kernel_set;

}  // namespace ode_parallel_sap
