#include "lanes_avx2.h"
//
#include "kernels_impl.h"

namespace ode_parallel_sap {

extern const Kernels kernels_avx2;
const Kernels kernels_avx2 = kernel_table;

}  // namespace ode_parallel_sap
