// For tests: lets CUDA fail as it does on other machines and on bad days.
#pragma once

#include <chrono>

namespace ode_parallel_sap {

// Lets the call-th CUDA call from now on, by any finder, fail as if the device had; 0: none.
void failCudaCall(unsigned long long call);

// How long a device that was out of memory is left alone at first.
void setMemoryRetry(std::chrono::milliseconds first);

}  // namespace ode_parallel_sap
