#include "lanes_avx512.h"
//
#include "kernels_impl.h"

namespace ode_parallel_sap {

extern const Kernels kernels_avx512;
const Kernels kernels_avx512 = kernel_table;

}  // namespace ode_parallel_sap
