#include "device.h"

#include <atomic>
#include <string>

#include "cuda_sweep.h"

namespace ode_parallel_sap {

namespace {

// The oldest architecture that this build has code for, as major * 10 + minor.
constexpr int least_capability = 75;

std::atomic<unsigned long long> calls_until_failure{0};

// As major * 10 + minor.
cudaError_t readCapability(int device, int& capability) {
  int major = 0, minor = 0;
  cudaError_t status = cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device);
  if (status == cudaSuccess)
    status = cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device);
  if (status != cudaSuccess) cudaGetLastError();
  capability = major * 10 + minor;
  return status;
}

}  // namespace

bool cudaCallIsToFail() {
  if (calls_until_failure.load(std::memory_order_relaxed) == 0) return false;
  return calls_until_failure.fetch_sub(1, std::memory_order_relaxed) == 1;
}

void failCudaCall(unsigned long long call) {
  calls_until_failure = call;
}

void checkCuda(cudaError_t status, const char* call) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // so that nobody else meets it
  const std::string text = call;
  throw DeviceFailure(text.substr(0, text.find('(')) + ": " + cudaGetErrorString(status));
}

void* DeviceMemory::allocate(std::size_t bytes) {
  void* memory = nullptr;
  CHECK_CUDA(cudaMalloc(&memory, bytes));
  return memory;
}

void* PinnedMemory::allocate(std::size_t bytes) {
  void* memory = nullptr;
  CHECK_CUDA(cudaHostAlloc(&memory, bytes, cudaHostAllocPortable));
  return memory;
}

bool cudaAvailable(std::string* why) {
  const auto no = [why](const std::string& reason) {
    if (why) *why = reason;
    return false;
  };
  int devices = 0;
  cudaError_t status = cudaGetDeviceCount(&devices);
  if (status != cudaSuccess) {
    cudaGetLastError();
    return no(cudaGetErrorString(status));
  }
  if (devices == 0) return no("no CUDA device");
  int capability = 0;
  status = readCapability(0, capability);
  if (status != cudaSuccess) return no(cudaGetErrorString(status));
  if (capability < least_capability)
    return no("the CUDA device is too old: compute capability " + std::to_string(capability / 10) +
              "." + std::to_string(capability % 10) + ", 7.5 is needed");
  return true;
}

int cudaDevices() {
  int devices = 0, usable = 0, capability = 0;
  if (cudaGetDeviceCount(&devices) != cudaSuccess) cudaGetLastError();
  while (usable < devices && readCapability(usable, capability) == cudaSuccess &&
         capability >= least_capability)
    ++usable;
  return usable;
}

}  // namespace ode_parallel_sap
