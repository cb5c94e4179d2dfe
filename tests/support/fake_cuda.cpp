#include "fake_cuda.h"

#include <cuda.h>
#include <cuda_runtime_api.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

// What the driver's opaque types are here.
struct CUctx_st {
  int device;
};
struct CUstream_st {
  int device;
};
struct CUevent_st {
  int device;
};
struct CUgraph_st {
  int device;
};
struct CUgraphExec_st {
  int device;
};

namespace {

using sap_test::FakeCuda;

struct Machine {
  std::mutex mutex;
  std::vector<FakeCuda::Device> devices;
  std::vector<std::unique_ptr<CUctx_st>> primary, created;
  std::unordered_map<void*, int> owners;  // of memory, by device
  int calls_without_context = 0;
  int locks_asked = 0;
  bool locks_allowed = true, links_allowed = true;
  std::unordered_map<void*, int> locked;  // by device
  std::map<int, std::set<int>> links;     // of devices to those whose memory they may read
};

// Outlives whatever gives things back at the program's end.
Machine& machine() {
  static Machine* const it = new Machine;
  return *it;
}

thread_local std::vector<CUcontext> stack;
thread_local int number = 0;
thread_local cudaError_t last_error = cudaSuccess;

using Lock = std::lock_guard<std::mutex>;

cudaError_t note(cudaError_t status) {
  if (status != cudaSuccess) last_error = status;
  return status;
}

bool exists(int device) {
  return device >= 0 && device < static_cast<int>(machine().devices.size());
}

// The machine is locked. Null where there is no room for a context.
CUcontext primaryContextOf(int device) {
  FakeCuda::Device& its = machine().devices[device];
  if (its.has_context) return machine().primary[device].get();
  ++its.tried;
  if (its.full) return nullptr;
  its.has_context = true;
  machine().primary[device].reset(new CUctx_st{device});
  return machine().primary[device].get();
}

// The device that a call of this thread works on. The machine is locked.
cudaError_t enter(int* device) {
  if (machine().devices.empty()) return note(cudaErrorNoDevice);
  if (stack.empty() || !stack.back()) {
    ++machine().calls_without_context;
    const CUcontext context = primaryContextOf(number);
    if (!context) return note(cudaErrorMemoryAllocation);
    if (stack.empty()) stack.push_back(nullptr);
    stack.back() = context;
  }
  *device = stack.back()->device;
  return cudaSuccess;
}

template <class Object>
cudaError_t create(Object** object) {
  const Lock lock(machine().mutex);
  int device = 0;
  if (const cudaError_t status = enter(&device)) return status;
  ++machine().devices[device].in_use;
  *object = new Object{device};
  return cudaSuccess;
}
template <class Object>
cudaError_t destroy(Object* object) {
  const Lock lock(machine().mutex);
  int device = 0;
  if (const cudaError_t status = enter(&device)) return status;
  --machine().devices[object->device].in_use;
  delete object;
  return cudaSuccess;
}

cudaError_t allocate(void** memory, std::size_t bytes) {
  const Lock lock(machine().mutex);
  int device = 0;
  if (const cudaError_t status = enter(&device)) return status;
  *memory = std::calloc(bytes, 1);
  if (!*memory) return note(cudaErrorMemoryAllocation);
  machine().owners[*memory] = device;
  ++machine().devices[device].in_use;
  return cudaSuccess;
}
// Takes memory off a list of the machine, or answers `unknown` where it is not on it.
cudaError_t giveBack(void* memory, std::unordered_map<void*, int> Machine::*list,
                     cudaError_t unknown) {
  const Lock lock(machine().mutex);
  int device = 0;
  if (const cudaError_t status = enter(&device)) return status;
  const auto found = (machine().*list).find(memory);
  if (found == (machine().*list).end()) return note(unknown);
  --machine().devices[found->second].in_use;
  (machine().*list).erase(found);
  return cudaSuccess;
}
cudaError_t release(void* memory) {
  const cudaError_t status = giveBack(memory, &Machine::owners, cudaErrorInvalidValue);
  if (status == cudaSuccess) std::free(memory);
  return status;
}

// Whatever else works on a device.
cudaError_t work() {
  const Lock lock(machine().mutex);
  int device = 0;
  return enter(&device);
}
cudaError_t launch() {
  const Lock lock(machine().mutex);
  int device = 0;
  if (const cudaError_t status = enter(&device)) return status;
  ++machine().devices[device].launches;
  return cudaSuccess;
}

// The driver.

CUresult CUDAAPI init(unsigned int) {
  return CUDA_SUCCESS;
}
CUresult CUDAAPI deviceGet(CUdevice* device, int ordinal) {
  *device = ordinal;
  return exists(ordinal) ? CUDA_SUCCESS : CUDA_ERROR_INVALID_DEVICE;
}
CUresult CUDAAPI primaryContextRetain(CUcontext* context, CUdevice device) {
  const Lock lock(machine().mutex);
  if (!exists(device)) return CUDA_ERROR_INVALID_DEVICE;
  *context = primaryContextOf(device);
  return *context ? CUDA_SUCCESS : CUDA_ERROR_OUT_OF_MEMORY;
}
CUresult CUDAAPI contextGetCurrent(CUcontext* context) {
  *context = stack.empty() ? nullptr : stack.back();
  return CUDA_SUCCESS;
}
CUresult CUDAAPI contextPush(CUcontext context) {
  if (!context) return CUDA_ERROR_INVALID_CONTEXT;
  stack.push_back(context);
  return CUDA_SUCCESS;
}
CUresult CUDAAPI contextPop(CUcontext* context) {
  if (stack.empty()) return CUDA_ERROR_INVALID_CONTEXT;
  if (context) *context = stack.back();
  stack.pop_back();
  return CUDA_SUCCESS;
}

void* driverFunction(const std::string& name) {
  if (name == "cuInit") return reinterpret_cast<void*>(&init);
  if (name == "cuDeviceGet") return reinterpret_cast<void*>(&deviceGet);
  if (name == "cuDevicePrimaryCtxRetain") return reinterpret_cast<void*>(&primaryContextRetain);
  if (name == "cuCtxGetCurrent") return reinterpret_cast<void*>(&contextGetCurrent);
  if (name == "cuCtxPushCurrent") return reinterpret_cast<void*>(&contextPush);
  if (name == "cuCtxPopCurrent") return reinterpret_cast<void*>(&contextPop);
  return nullptr;
}

}  // namespace

namespace sap_test {

void FakeCuda::setDevices(const std::string& devices) {
  const Lock lock(machine().mutex);
  machine().devices.resize(devices.size());
  machine().primary.resize(devices.size());
  for (std::size_t i = 0; i < devices.size(); ++i) {
    machine().devices[i].full = devices[i] == 'f';
    if (devices[i] == 'o') machine().devices[i].generation = 8;
  }
}
std::tuple<int, const void*, std::size_t> FakeCuda::current() {
  int device = -1;
  cudaGetDevice(&device);
  return {device, stack.empty() ? nullptr : stack.back(), stack.size()};
}
FakeCuda::Device FakeCuda::device(int number) {
  const Lock lock(machine().mutex);
  return machine().devices.at(number);
}
void FakeCuda::allowLinks(bool allowed) {
  const Lock lock(machine().mutex);
  machine().links_allowed = allowed;
}
int FakeCuda::callsWithoutContext() {
  const Lock lock(machine().mutex);
  return machine().calls_without_context;
}
FakeCuda::Locks FakeCuda::locks() {
  const Lock lock(machine().mutex);
  return {machine().locks_asked, machine().locked.size()};
}
void FakeCuda::allowLocks(bool allowed) {
  const Lock lock(machine().mutex);
  machine().locks_allowed = allowed;
}
const void* FakeCuda::createContext(int device) {
  const Lock lock(machine().mutex);
  machine().created.emplace_back(new CUctx_st{device});
  stack.push_back(machine().created.back().get());
  return stack.back();
}

}  // namespace sap_test

// The runtime.

extern "C" {

const char* cudaGetErrorString(cudaError_t status) {
  return status == cudaErrorMemoryAllocation ? "out of memory" : "an error";
}
cudaError_t cudaGetLastError() {
  const cudaError_t status = last_error;
  last_error = cudaSuccess;
  return status;
}
cudaError_t cudaPeekAtLastError() {
  return last_error;
}

cudaError_t cudaGetDeviceCount(int* count) {
  const Lock lock(machine().mutex);
  *count = static_cast<int>(machine().devices.size());
  return *count > 0 ? cudaSuccess : note(cudaErrorNoDevice);
}
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int device) {
  if (!exists(device)) return note(cudaErrorInvalidDevice);
  const Lock lock(machine().mutex);
  *value = attribute == cudaDevAttrComputeCapabilityMajor   ? machine().devices[device].generation
           : attribute == cudaDevAttrComputeCapabilityMinor ? 0
           : attribute == cudaDevAttrMultiProcessorCount    ? 4
                                                            : 1 << 16;
  return cudaSuccess;
}
cudaError_t cudaDeviceCanAccessPeer(int* can, int device, int other) {
  if (!exists(device) || !exists(other)) return note(cudaErrorInvalidDevice);
  *can = device != other;
  return cudaSuccess;
}
cudaError_t cudaDeviceEnablePeerAccess(int other, unsigned int) {
  const Lock lock(machine().mutex);
  int device = 0;
  if (const cudaError_t status = enter(&device)) return status;
  if (!exists(other) || other == device) return note(cudaErrorInvalidDevice);
  ++machine().devices[device].asked_links;
  if (!machine().links_allowed) return note(cudaErrorTooManyPeers);
  std::set<int>& links = machine().links[device];
  if (!links.insert(other).second) return note(cudaErrorPeerAccessAlreadyEnabled);
  ++machine().devices[device].linked;
  return cudaSuccess;
}
cudaError_t cudaGetDevice(int* device) {
  *device = stack.empty() || !stack.back() ? number : stack.back()->device;
  return cudaSuccess;
}
cudaError_t cudaSetDevice(int device) {
  const Lock lock(machine().mutex);
  if (!exists(device)) return note(cudaErrorInvalidDevice);
  number = device;
  if (stack.empty()) stack.push_back(nullptr);
  stack.back() = primaryContextOf(device);
  return stack.back() ? cudaSuccess : note(cudaErrorMemoryAllocation);
}

cudaError_t cudaMalloc(void** memory, std::size_t bytes) {
  return allocate(memory, bytes);
}
cudaError_t cudaHostAlloc(void** memory, std::size_t bytes, unsigned int) {
  return allocate(memory, bytes);
}
cudaError_t cudaFree(void* memory) {
  return release(memory);
}
cudaError_t cudaFreeHost(void* memory) {
  return release(memory);
}
cudaError_t cudaHostRegister(void* memory, std::size_t, unsigned int) {
  const Lock lock(machine().mutex);
  int device = 0;
  if (const cudaError_t status = enter(&device)) return status;
  ++machine().locks_asked;
  if (!machine().locks_allowed) return note(cudaErrorMemoryAllocation);
  if (!machine().locked.emplace(memory, device).second)
    return note(cudaErrorHostMemoryAlreadyRegistered);
  ++machine().devices[device].in_use;
  return cudaSuccess;
}
cudaError_t cudaHostUnregister(void* memory) {
  return giveBack(memory, &Machine::locked, cudaErrorHostMemoryNotRegistered);
}
cudaError_t cudaMemGetInfo(std::size_t* free, std::size_t* total) {
  *free = *total = std::size_t{1} << 36;
  return work();
}
cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind,
                            cudaStream_t) {
  if (const cudaError_t status = work()) return status;
  std::memcpy(to, from, bytes);
  return cudaSuccess;
}
cudaError_t cudaMemcpyPeerAsync(void* to, int, const void* from, int, std::size_t bytes,
                                cudaStream_t) {
  if (const cudaError_t status = work()) return status;
  std::memcpy(to, from, bytes);
  return cudaSuccess;
}
cudaError_t cudaMemsetAsync(void* to, int value, std::size_t bytes, cudaStream_t) {
  if (const cudaError_t status = work()) return status;
  std::memset(to, value, bytes);
  return cudaSuccess;
}

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned int) {
  return create(stream);
}
cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  return destroy(stream);
}
cudaError_t cudaStreamSynchronize(cudaStream_t) {
  return work();
}
cudaError_t cudaStreamWaitEvent(cudaStream_t, cudaEvent_t, unsigned int) {
  return work();
}
cudaError_t cudaStreamBeginCapture(cudaStream_t, cudaStreamCaptureMode) {
  return work();
}
cudaError_t cudaStreamEndCapture(cudaStream_t, cudaGraph_t* graph) {
  return create(graph);
}
cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned int) {
  return create(event);
}
cudaError_t cudaEventDestroy(cudaEvent_t event) {
  return destroy(event);
}
cudaError_t cudaEventRecord(cudaEvent_t, cudaStream_t) {
  return work();
}
cudaError_t cudaEventSynchronize(cudaEvent_t) {
  return work();
}
cudaError_t cudaEventElapsedTime(float* ms, cudaEvent_t, cudaEvent_t) {
  *ms = 0;
  return work();
}
cudaError_t cudaGraphInstantiate(cudaGraphExec_t* graph, cudaGraph_t, unsigned long long) {
  return create(graph);
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  return destroy(graph);
}
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t graph) {
  return destroy(graph);
}
cudaError_t cudaGraphLaunch(cudaGraphExec_t, cudaStream_t) {
  return launch();
}

cudaError_t cudaFuncGetAttributes(cudaFuncAttributes* attributes, const void*) {
  std::memset(attributes, 0, sizeof *attributes);
  attributes->ptxVersion = attributes->binaryVersion = 90;
  attributes->maxThreadsPerBlock = 1024;
  return work();
}
cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags(int* blocks, const void*, int,
                                                                   std::size_t, unsigned int) {
  *blocks = 1;
  return work();
}
cudaError_t cudaLaunchKernelExC(const cudaLaunchConfig_t*, const void*, void**) {
  return launch();
}
cudaError_t cudaLaunchKernel(const void*, dim3, dim3, void**, std::size_t, cudaStream_t) {
  return launch();
}

cudaError_t cudaGetDriverEntryPoint(const char* name, void** function, unsigned long long,
                                    cudaDriverEntryPointQueryResult*) {
  *function = driverFunction(name);
  return cudaSuccess;
}
#if CUDART_VERSION >= 12050
cudaError_t cudaGetDriverEntryPointByVersion(const char* name, void** function, unsigned int,
                                             unsigned long long, cudaDriverEntryPointQueryResult*) {
  *function = driverFunction(name);
  return cudaSuccess;
}
#endif

// What nvcc's code for kernels calls.
void** __cudaRegisterFatBinary(void*) {
  static void* handle = nullptr;
  return &handle;
}
void __cudaRegisterFatBinaryEnd(void**) {}
void __cudaUnregisterFatBinary(void**) {}
char __cudaInitModule(void**) {
  return 1;
}
void __cudaRegisterFunction(void**, const char*, char*, const char*, int, uint3*, uint3*, dim3*,
                            dim3*, int*) {}
void __cudaRegisterVar(void**, char*, char*, const char*, int, std::size_t, int, int) {}
unsigned int __cudaPushCallConfiguration(dim3, dim3, std::size_t, CUstream_st*) {
  return 0;
}
cudaError_t __cudaPopCallConfiguration(dim3* grid, dim3* block, std::size_t* shared, void* stream) {
  *grid = *block = {1, 1, 1};
  *shared = 0;
  *static_cast<cudaStream_t*>(stream) = nullptr;
  return cudaSuccess;
}
cudaError_t __cudaGetKernel(cudaKernel_t* kernel, const void* function) {
  *kernel = reinterpret_cast<cudaKernel_t>(const_cast<void*>(function));
  return cudaSuccess;
}
cudaError_t __cudaLaunchKernel(cudaKernel_t, dim3, dim3, void**, std::size_t, cudaStream_t) {
  return launch();
}

}  // extern "C"
