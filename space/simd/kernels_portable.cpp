#include "lanes_portable.h"
//
#include "kernels_impl.h"

namespace ode_parallel_sap {

extern const Kernels kernels_portable;
const Kernels kernels_portable = kernel_table;

}  // namespace ode_parallel_sap
