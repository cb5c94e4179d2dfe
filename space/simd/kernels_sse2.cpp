#include "lanes_sse2.h"
//
#include "kernels_impl.h"

namespace ode_parallel_sap {

extern const Kernels kernels_sse2;
const Kernels kernels_sse2 = kernel_table;

}  // namespace ode_parallel_sap
