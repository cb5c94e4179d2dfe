#include "space/simd/kernels.h"

#include <array>
#include <atomic>
#include <cstring>

namespace ode_parallel_sap {

namespace {

std::atomic<const KernelSet*>& chosenSet() {
  static std::atomic<const KernelSet*> chosen{allKernelSets()[0]};
  return chosen;
}

}  // namespace

const KernelSet& kernelSet() {
  return *chosenSet().load(std::memory_order_relaxed);
}

void chooseKernelSet(const KernelSet& set) {
  chosenSet().store(&set, std::memory_order_relaxed);
}

const KernelSet* const* allKernelSets() {
  static const auto all = [] {
    std::array<const KernelSet*, 5> list = {};
    int count = 0;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
      list[count++] = &kernels_avx512;
    if (__builtin_cpu_supports("avx2")) list[count++] = &kernels_avx2;
    list[count++] = &kernels_sse2;
#elif defined(__AARCH64EL__)
    list[count++] = &kernels_neon;
#endif
    list[count++] = &kernels_portable;
    return list;
  }();
  return all.data();
}

const KernelSet* kernelSetNamed(const char* name) {
  const KernelSet* const* set = allKernelSets();
  while (*set && std::strcmp((*set)->name, name) != 0) ++set;
  return *set;
}

}  // namespace ode_parallel_sap
