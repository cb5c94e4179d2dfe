// Marks functions that kernels and host code share.
#pragma once

#if defined(__CUDACC__)
#define ODE_PARALLEL_SAP_BOTH_SIDES __host__ __device__
#else
#define ODE_PARALLEL_SAP_BOTH_SIDES
#endif
