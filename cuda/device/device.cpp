#include "cuda/device/device.h"

#include <cuda.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <vector>

#include "cuda/device/fault_injection.h"

namespace ode_parallel_sap {

namespace {

// fixed: the oldest architecture that this build has code for, as major * 10 + minor.
constexpr int least_capability = 75;

std::atomic<unsigned long long> calls_until_failure{0};
std::atomic<std::chrono::milliseconds> first_retry{std::chrono::seconds(4)};

}  // namespace

bool cudaCallIsToFail() {
  if (calls_until_failure.load(std::memory_order_relaxed) == 0) return false;
  return calls_until_failure.fetch_sub(1, std::memory_order_relaxed) == 1;
}

void failCudaCall(unsigned long long call) {
  calls_until_failure = call;
}
void setMemoryRetry(std::chrono::milliseconds first) {
  first_retry = first;
}

void MemoryRetry::failed() {
  using Clock = std::chrono::steady_clock;
  constexpr Clock::duration longest = std::chrono::minutes(5);
  const Clock::rep interval = interval_ ? std::min(2 * interval_, longest.count())
                                        : Clock::duration(first_retry.load()).count();
  interval_ = interval;
  next_ = Clock::now().time_since_epoch().count() + interval;
}
bool MemoryRetry::isDue() const {
  return next_ != 0 && std::chrono::steady_clock::now().time_since_epoch().count() >= next_;
}

int attributeOf(int device, cudaDeviceAttr attribute) {
  int value = 0;
  CHECK_CUDA(cudaDeviceGetAttribute(&value, attribute, device));
  return value;
}

void checkCuda(cudaError_t status, const char* call) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // so that nobody else meets it
  const std::string text = call;
  throw DeviceFailure(text.substr(0, text.find('(')) + ": " + cudaGetErrorString(status),
                      status == cudaErrorMemoryAllocation);
}

namespace {

// What is called of the driver itself.
struct Driver {
  decltype(&cuInit) init;
  decltype(&cuDeviceGet) deviceGet;
  decltype(&cuDevicePrimaryCtxRetain) primaryContextRetain;
  decltype(&cuDevicePrimaryCtxRelease) primaryContextRelease;
  decltype(&cuDevicePrimaryCtxGetState) primaryContextState;
  decltype(&cuCtxGetId) contextId;
  decltype(&cuCtxGetCurrent) contextGetCurrent;
  decltype(&cuCtxPushCurrent) contextPush;
  decltype(&cuCtxPopCurrent) contextPop;
};

// fixed: the version of the driver that has the functions as cuda.h declares them.
constexpr unsigned int driver_version = 12000;

template <class Function>
void lookUp(const char* name, Function& function) {
  void* found = nullptr;
#if CUDART_VERSION >= 12050
  CHECK_CUDA(cudaGetDriverEntryPointByVersion(name, &found, driver_version, cudaEnableDefault));
#else
  CHECK_CUDA(cudaGetDriverEntryPoint(name, &found, cudaEnableDefault));
#endif
  if (!found) throw DeviceFailure(std::string("the driver has no ") + name);
  function = reinterpret_cast<Function>(found);
}

// The driver's errors are numbered as the runtime's.
template <class Function, class... Arguments>
void callDriver(const char* name, Function function, Arguments... arguments) {
  checkCuda(cudaCallIsToFail() ? cudaErrorLaunchFailure
                               : static_cast<cudaError_t>(function(arguments...)),
            name);
}

// Asked for again at the next call where it throws.
const Driver& driver() {
  static const Driver found = [] {
    Driver driver;
    lookUp("cuInit", driver.init);
    lookUp("cuDeviceGet", driver.deviceGet);
    lookUp("cuDevicePrimaryCtxRetain", driver.primaryContextRetain);
    lookUp("cuDevicePrimaryCtxRelease", driver.primaryContextRelease);
    lookUp("cuDevicePrimaryCtxGetState", driver.primaryContextState);
    lookUp("cuCtxGetId", driver.contextId);
    lookUp("cuCtxGetCurrent", driver.contextGetCurrent);
    lookUp("cuCtxPushCurrent", driver.contextPush);
    lookUp("cuCtxPopCurrent", driver.contextPop);
    callDriver("cuInit", driver.init, 0);
    return driver;
  }();
  return found;
}

}  // namespace

DriverContext driverContextOf(int device) {
  CUdevice number = 0;
  DriverContext context;
  context.device = device;
  callDriver("cuDeviceGet", driver().deviceGet, &number, device);
  callDriver("cuDevicePrimaryCtxRetain", driver().primaryContextRetain, &context.handle, number);
  callDriver("cuCtxGetId", driver().contextId, context.handle, &context.id);
  return context;
}

// A device is asked, as a handle of what is gone must not be: one that was destroyed is inactive,
// or another by now.
bool isLost(const DriverContext& context) noexcept {
  CUdevice device = 0;
  CUcontext now = nullptr;
  unsigned int flags = 0;
  int active = 0;
  unsigned long long id = 0;
  if (driver().deviceGet(&device, context.device) != CUDA_SUCCESS ||
      driver().primaryContextState(device, &flags, &active) != CUDA_SUCCESS || !active ||
      driver().primaryContextRetain(&now, device) != CUDA_SUCCESS)
    return true;
  const bool known = driver().contextId(now, &id) == CUDA_SUCCESS;
  driver().primaryContextRelease(device);
  return !known || id != context.id;
}

void linkDevices(const DriverContext& one, const DriverContext& other) {
  if (one.device == other.device) return;
  for (const auto& [reader, read] : {std::pair(one, other), std::pair(other, one)}) {
    const ScopedDevice current(reader);
    int can = 0;
    CHECK_CUDA(cudaDeviceCanAccessPeer(&can, reader.device, read.device));
    const cudaError_t linked =
        can ? cudaDeviceEnablePeerAccess(read.device, 0) : cudaErrorPeerAccessUnsupported;
    if (linked == cudaErrorPeerAccessAlreadyEnabled)
      cudaGetLastError();
    else
      checkCuda(linked, "to read the memory of another GPU");
  }
}

ScopedDevice::ScopedDevice(const DriverContext& context) {
  CUcontext current = nullptr;
  callDriver("cuCtxGetCurrent", driver().contextGetCurrent, &current);
  if (current == context.handle) return;
  callDriver("cuCtxPushCurrent", driver().contextPush, context.handle);
  changed_ = true;
}

ScopedDevice::ScopedDevice(const DriverContext& context, const std::nothrow_t&) noexcept
    // Where there is a context, the driver has been found.
    : changed_(context.handle && driver().contextPush(context.handle) == CUDA_SUCCESS) {}

ScopedDevice::~ScopedDevice() {
  CUcontext popped = nullptr;
  if (changed_) driver().contextPop(&popped);
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

std::vector<int> cudaDevices(std::string* why) {
  std::vector<int> usable;
  std::string reason = "no CUDA device";
  try {
    int count = 0;
    CHECK_CUDA(cudaGetDeviceCount(&count));
    for (int device = 0; device < count; ++device) {
      const int major = attributeOf(device, cudaDevAttrComputeCapabilityMajor);
      const int minor = attributeOf(device, cudaDevAttrComputeCapabilityMinor);
      if (major * 10 + minor >= least_capability)
        usable.push_back(device);
      else
        reason = "the CUDA device is too old: compute capability " + std::to_string(major) + "." +
                 std::to_string(minor) + ", 7.5 is needed";
    }
  } catch (const DeviceFailure& failure) {
    usable.clear();
    reason = failure.what();
  }
  if (usable.empty() && why) *why = reason;
  return usable;
}

}  // namespace ode_parallel_sap
