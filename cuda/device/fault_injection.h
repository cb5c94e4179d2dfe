// For tests: lets CUDA fail as it does on other machines and on bad days.
#pragma once

#include <chrono>

namespace ode_parallel_sap {

// Lets the call-th CUDA call from now on, by any finder, fail as if the device had; 0: none.
void failCudaCall(unsigned long long call);

// Lets the allocation-th allocation from now on, on a device or of pinned memory, find no memory;
// 0: none.
void failCudaAllocation(unsigned long long allocation);

// What cudaDevices() meets. With TooOld there is one device, of compute capability 5.2.
enum class PretendedMachine { Real, NoDriver, NoDevice, TooOld };
void pretendMachine(PretendedMachine machine);

// How long a device that was out of memory is left alone at first.
void setMemoryRetry(std::chrono::milliseconds first);

// Has every second of those who ask for a device's processors told half of them, as if it were a
// smaller one of its generation.
void pretendSmallerDevices(bool smaller);

}  // namespace ode_parallel_sap
