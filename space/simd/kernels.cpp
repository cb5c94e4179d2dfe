#include "kernels.h"

namespace ode_parallel_sap {

extern const KernelSet kernels_portable;
#if defined(__x86_64__)
extern const KernelSet kernels_sse2, kernels_avx2, kernels_avx512;
#endif

namespace {

// Best first, null last.
struct Available {
  const KernelSet* list[5] = {};
  Available() {
    int count = 0;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
      list[count++] = &kernels_avx512;
    if (__builtin_cpu_supports("avx2")) list[count++] = &kernels_avx2;
    list[count++] = &kernels_sse2;
#endif
    list[count++] = &kernels_portable;
  }
};

const Available& available() {
  static const Available available;
  return available;
}

}  // namespace

const KernelSet& kernelSet() {
  static const KernelSet& best = *available().list[0];
  return best;
}

const KernelSet* const* allKernelSets() {
  return available().list;
}

}  // namespace ode_parallel_sap
