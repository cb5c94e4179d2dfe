// Marks functions that kernels and host code share.
#ifndef ODE_PARALLEL_SAP_CUDA_BOTH_SIDES_H
#define ODE_PARALLEL_SAP_CUDA_BOTH_SIDES_H

#if defined(__CUDACC__)
#define ODE_PARALLEL_SAP_BOTH_SIDES __host__ __device__
#else
#define ODE_PARALLEL_SAP_BOTH_SIDES
#endif

#endif
