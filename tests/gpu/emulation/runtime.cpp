#include "tests/gpu/emulation/runtime.h"

#include <cuda.h>
#include <cuda_runtime_api.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <unordered_map>
#include <vector>

namespace emulation {
namespace {

// Whether an event has happened, each time that it was recorded.
using Happened = std::shared_ptr<std::vector<char>>;

struct Work {
  std::function<void()> work;  // or, if empty:
  Happened event;
  std::size_t time = 0;  // which of its records is waited for
  bool canBegin() const { return !event || (*event)[time]; }
};

}  // namespace
}  // namespace emulation

// What the driver's opaque types are here.
struct CUctx_st {
  int device;
  unsigned long long id = 1;
};
// What is made on a device knows the context in which that was.
struct OnDevice {
  explicit OnDevice(int device);
  int device;
  unsigned long long context;
};
struct CUevent_st : OnDevice {
  using OnDevice::OnDevice;
  emulation::Happened happened = std::make_shared<std::vector<char>>(1, 1);
};
struct CUstream_st : OnDevice {
  using OnDevice::OnDevice;
  std::uint64_t priority = emulation::random().bits();
  std::deque<emulation::Work> work = {};
  std::unique_ptr<std::vector<emulation::Work>> recorded = {};  // while it is captured
};
struct CUgraph_st : OnDevice {
  using OnDevice::OnDevice;
  std::vector<emulation::Work> work = {};
};
struct CUgraphExec_st : CUgraph_st {
  using CUgraph_st::CUgraph_st;
};

namespace emulation {
namespace {

struct Memory {
  int device;
  std::size_t bytes;  // on the device; 0: on the host
};

struct Machine {
  std::mutex mutex;
  std::vector<Device> devices;
  std::vector<std::unique_ptr<CUctx_st>> contexts;  // primary ones first
  std::vector<CUstream_st*> streams;
  std::unordered_map<void*, Memory> memory, locked;
  std::map<int, std::set<int>> links;  // of devices to those whose memory they may read
  int calls_without_context = 0, locks_asked = 0;
  unsigned long long allocations_until_failure = 0;
  bool has_driver = true;
  std::atomic<std::size_t> copied{0};
};

// Outlives whatever gives things back at the program's end.
Machine& machine() {
  static Machine* const it = new Machine;
  return *it;
}

using Lock = std::lock_guard<std::mutex>;
// Of one statement, in which the machine is locked.
struct Locked {
  Lock lock{machine().mutex};
  Machine* operator->() const { return &machine(); }
};

thread_local std::vector<CUcontext> stack;

bool exists(int device) {
  return device >= 0 && device < static_cast<int>(machine().devices.size());
}

// The machine is locked, here and below. Null where there is no room for a context.
CUcontext primaryContextOf(int device) {
  Device& its = machine().devices[device];
  if (!its.has_context) ++its.tried;
  if (its.full) return nullptr;
  its.has_context = true;
  return machine().contexts[device].get();
}

// Ends the program as a driver may that is given what is gone.
void require(const OnDevice* object) {
  if (object->context == machine().contexts[object->device]->id) return;
  std::fprintf(stderr, "a handle of a context that was reset\n");
  std::abort();
}

// Does a piece of work of any stream, most often of the one that is ahead of others. False where
// there is none, or all wait.
bool step() {
  std::vector<CUstream_st*> ready;
  for (CUstream_st* stream : machine().streams)
    if (!stream->work.empty() && stream->work.front().canBegin()) ready.push_back(stream);
  if (ready.empty()) return false;
  CUstream_st* const chosen =
      random().chance(0.2) ? ready[random().below(ready.size())]
                           : *std::max_element(ready.begin(), ready.end(),
                                               [](const CUstream_st* a, const CUstream_st* b) {
                                                 return a->priority < b->priority;
                                               });
  const Work work = std::move(chosen->work.front());
  chosen->work.pop_front();
  if (work.work) work.work();
  return true;
}

template <class Condition>
void doUntil(Condition condition) {
  while (!condition()) {
    if (step()) continue;
    std::fprintf(stderr, "streams wait for each other\n");
    std::abort();
  }
}

void add(cudaStream_t stream, Work work) {
  require(stream);
  if (stream->recorded)
    stream->recorded->push_back(std::move(work));
  else
    stream->work.push_back(std::move(work));
}

// A call that works on a device: work(device), with the machine locked.
template <class Function>
cudaError_t call(Function work) {
  const Lock lock(machine().mutex);
  if (machine().devices.empty()) return cudaErrorNoDevice;
  if (stack.empty() || !stack.back()) {
    ++machine().calls_without_context;
    const CUcontext context = primaryContextOf(0);
    if (!context) return cudaErrorMemoryAllocation;
    if (stack.empty()) stack.push_back(nullptr);
    stack.back() = context;
  }
  return work(stack.back()->device);
}

// A call that adds work to a stream.
cudaError_t push(cudaStream_t stream, std::function<void()> work) {
  return call([&](int) {
    add(stream, {std::move(work), nullptr, 0});
    return cudaSuccess;
  });
}

template <class Object>
cudaError_t create(Object** object) {
  return call([&](int device) {
    ++machine().devices[device].in_use;
    *object = new Object(device);
    return cudaSuccess;
  });
}
template <class Object>
cudaError_t destroy(Object* object) {
  return call([&](int) {
    require(object);
    --machine().devices[object->device].in_use;
    delete object;
    return cudaSuccess;
  });
}

// No larger than asked for, so that a sanitizer sees what is beyond.
cudaError_t allocate(void** memory, std::size_t bytes, bool on_device) {
  return call([&](int device) {
    unsigned long long& left = machine().allocations_until_failure;
    if (left && --left == 0) return cudaErrorMemoryAllocation;
    if (posix_memalign(memory, 256, std::max<std::size_t>(bytes, 1))) std::abort();
    const bool any = settings().kernels_run;
    std::memset(*memory, any ? static_cast<int>(random().below(256)) : 0, bytes);
    machine().memory[*memory] = {device, on_device ? bytes : 0};
    ++machine().devices[device].in_use;
    return cudaSuccess;
  });
}
// Takes memory off a list of the machine, or answers `unknown` where it is not on it.
cudaError_t giveBack(void* memory, std::unordered_map<void*, Memory>& list, cudaError_t unknown) {
  return call([&](int device) {
    const auto found = list.find(memory);
    if (found == list.end()) return unknown;
    for (CUstream_st* stream : machine().streams)
      if (stream->device == device) doUntil([=] { return stream->work.empty(); });
    --machine().devices[found->second.device].in_use;
    list.erase(found);
    return cudaSuccess;
  });
}
cudaError_t release(void* memory) {
  const cudaError_t status = giveBack(memory, machine().memory, cudaErrorInvalidValue);
  if (status == cudaSuccess) std::free(memory);
  return status;
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
  if (!exists(device)) return CUDA_ERROR_INVALID_DEVICE;
  if (settings().contexts_wait) ++Locked()->devices[device].tried;
  while (settings().contexts_wait) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const Lock lock(machine().mutex);
  *context = primaryContextOf(device);
  return *context ? CUDA_SUCCESS : CUDA_ERROR_OUT_OF_MEMORY;
}
CUresult CUDAAPI primaryContextRelease(CUdevice) {
  return CUDA_SUCCESS;
}
CUresult CUDAAPI primaryContextState(CUdevice device, unsigned int* flags, int* active) {
  *flags = 0;
  *active = Locked()->devices[device].has_context;
  return CUDA_SUCCESS;
}
CUresult CUDAAPI contextId(CUcontext context, unsigned long long* id) {
  const Lock lock(machine().mutex);
  *id = context->id;
  return CUDA_SUCCESS;
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
  *context = stack.back();
  stack.pop_back();
  return CUDA_SUCCESS;
}

cudaError_t driverFunction(const std::string& name, void** function) {
  const std::map<std::string, void*> functions = {
      {"cuInit", reinterpret_cast<void*>(&init)},
      {"cuDeviceGet", reinterpret_cast<void*>(&deviceGet)},
      {"cuDevicePrimaryCtxRetain", reinterpret_cast<void*>(&primaryContextRetain)},
      {"cuDevicePrimaryCtxRelease", reinterpret_cast<void*>(&primaryContextRelease)},
      {"cuDevicePrimaryCtxGetState", reinterpret_cast<void*>(&primaryContextState)},
      {"cuCtxGetId", reinterpret_cast<void*>(&contextId)},
      {"cuCtxGetCurrent", reinterpret_cast<void*>(&contextGetCurrent)},
      {"cuCtxPushCurrent", reinterpret_cast<void*>(&contextPush)},
      {"cuCtxPopCurrent", reinterpret_cast<void*>(&contextPop)}};
  *function = functions.at(name);
  return cudaSuccess;
}

}  // namespace

void setDevices(const std::string& devices) {
  machine().has_driver = devices != "no-driver";
  if (!machine().has_driver) return;
  for (const char letter : devices) {
    Device device;
    device.full = letter == 'f';
    if (letter == 'o') device.generation = 8;
    if (letter == 'x') device.generation = 5;
    machine().contexts.emplace_back(new CUctx_st{static_cast<int>(machine().devices.size())});
    machine().devices.push_back(device);
  }
}
Device device(int number) {
  return Locked()->devices.at(number);
}
void setFull(int device, bool full) {
  Locked()->devices.at(device).full = full;
}
void failAllocation(unsigned long long allocation) {
  Locked()->allocations_until_failure = allocation;
}
void reset(int device) {
  const Lock lock(machine().mutex);
  machine().devices[device].has_context = false;
  ++machine().contexts[device]->id;
  for (auto* all : {&machine().memory, &machine().locked})
    for (auto at = all->begin(); at != all->end();)
      at = at->second.device == device ? all->erase(at) : std::next(at);
  std::vector<CUstream_st*>& streams = machine().streams;
  streams.erase(std::remove_if(streams.begin(), streams.end(),
                               [=](const CUstream_st* each) { return each->device == device; }),
                streams.end());
}
int callsWithoutContext() {
  return Locked()->calls_without_context;
}
std::size_t memoryHeld() {
  std::size_t bytes = 0;
  for (const auto& [at, memory] : machine().memory) bytes += memory.bytes;
  return bytes;
}
Locks locks() {
  const Lock lock(machine().mutex);
  return {machine().locks_asked, machine().locked.size()};
}
std::size_t copiedBytes() {
  return machine().copied;
}
std::pair<const void*, std::size_t> contextOfThread() {
  return {stack.empty() ? nullptr : stack.back(), stack.size()};
}
void createContext(int device) {
  const Lock lock(machine().mutex);
  machine().contexts.emplace_back(new CUctx_st{device});
  stack.push_back(machine().contexts.back().get());
}
Settings& settings() {
  static Settings settings;
  return settings;
}

sap_test::Random& random() {
  static sap_test::Random numbers(1);
  return numbers;
}
void shuffleStreams() {
  for (CUstream_st* stream : machine().streams) stream->priority = random().bits();
}
std::size_t pending() {
  std::size_t pieces = 0;
  for (const CUstream_st* stream : machine().streams) pieces += stream->work.size();
  return pieces;
}

cudaError_t launch(cudaStream_t stream, std::function<void()> work) {
  return call([&](int device) {
    ++machine().devices[device].launches;
    if (settings().kernels_run) add(stream, {std::move(work), nullptr, 0});
    return cudaSuccess;
  });
}
cudaError_t launchWithScratch(void* scratch, std::size_t& bytes, std::size_t needed,
                              cudaStream_t stream, std::function<void()> work) {
  if (!scratch) {
    bytes = 1 + needed;
    return cudaSuccess;
  }
  return launch(stream, [=, size = bytes] {
    std::memset(scratch, 0x5a, size);
    work();
  });
}

}  // namespace emulation

OnDevice::OnDevice(int device)
    : device(device), context(emulation::machine().contexts[device]->id) {}

using namespace emulation;

// The runtime.

extern "C" {

const char* cudaGetErrorString(cudaError_t status) {
  return status == cudaErrorMemoryAllocation     ? "out of memory"
         : status == cudaErrorNoDevice           ? "no device"
         : status == cudaErrorInsufficientDriver ? "no driver"
                                                 : "an error";
}
cudaError_t cudaGetLastError() {
  return cudaSuccess;
}

cudaError_t cudaGetDeviceCount(int* count) {
  const Lock lock(machine().mutex);
  if (!machine().has_driver) return cudaErrorInsufficientDriver;
  *count = static_cast<int>(machine().devices.size());
  return *count > 0 ? cudaSuccess : cudaErrorNoDevice;
}
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int device) {
  const Lock lock(machine().mutex);
  if (!exists(device)) return cudaErrorInvalidDevice;
  *value = attribute == cudaDevAttrComputeCapabilityMajor ? machine().devices[device].generation
           : attribute == cudaDevAttrComputeCapabilityMinor
               ? 0
               : 1 + static_cast<int>(emulation::random().below(2));
  return cudaSuccess;
}
cudaError_t cudaDeviceCanAccessPeer(int* can, int device, int other) {
  if (!exists(device) || !exists(other)) return cudaErrorInvalidDevice;
  *can = device != other && settings().links != Settings::None;
  return cudaSuccess;
}
cudaError_t cudaDeviceEnablePeerAccess(int other, unsigned int) {
  return call([&](int device) {
    if (!exists(other) || other == device) return cudaErrorInvalidDevice;
    ++machine().devices[device].asked_links;
    if (settings().links == Settings::Refused) return cudaErrorTooManyPeers;
    if (!machine().links[device].insert(other).second) return cudaErrorPeerAccessAlreadyEnabled;
    ++machine().devices[device].linked;
    return cudaSuccess;
  });
}

cudaError_t cudaMalloc(void** memory, std::size_t bytes) {
  return allocate(memory, bytes, true);
}
cudaError_t cudaHostAlloc(void** memory, std::size_t bytes, unsigned int) {
  return allocate(memory, bytes, false);
}
cudaError_t cudaFree(void* memory) {
  return release(memory);
}
cudaError_t cudaFreeHost(void* memory) {
  return release(memory);
}
cudaError_t cudaHostRegister(void* memory, std::size_t, unsigned int) {
  return call([&](int device) {
    ++machine().locks_asked;
    if (!settings().locks_allowed) return cudaErrorMemoryAllocation;
    if (!machine().locked.insert({memory, {device, 0}}).second)
      return cudaErrorHostMemoryAlreadyRegistered;
    ++machine().devices[device].in_use;
    return cudaSuccess;
  });
}
cudaError_t cudaHostUnregister(void* memory) {
  return giveBack(memory, machine().locked, cudaErrorHostMemoryNotRegistered);
}
cudaError_t cudaHostGetDevicePointer(void** pointer, void* memory, unsigned int) {
  *pointer = memory;
  return call([](int) { return cudaSuccess; });
}
cudaError_t cudaMemGetInfo(std::size_t* free, std::size_t* total) {
  *free = *total = std::size_t{1} << 36;
  return call([](int) { return cudaSuccess; });
}
cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind,
                            cudaStream_t stream) {
  machine().copied += bytes;
  return push(stream, [=] { std::memcpy(to, from, bytes); });
}
cudaError_t cudaMemsetAsync(void* to, int value, std::size_t bytes, cudaStream_t stream) {
  return push(stream, [=] { std::memset(to, value, bytes); });
}

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned int) {
  const cudaError_t status = create(stream);
  if (status == cudaSuccess) Locked()->streams.push_back(*stream);
  return status;
}
cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  {
    const Lock lock(machine().mutex);
    std::vector<CUstream_st*>& all = machine().streams;
    all.erase(std::find(all.begin(), all.end(), stream));
  }
  return destroy(stream);
}
cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
  return call([&](int) {
    require(stream);
    doUntil([=] { return stream->work.empty(); });
    return cudaSuccess;
  });
}
cudaError_t cudaStreamWaitEvent(cudaStream_t stream, cudaEvent_t event, unsigned int) {
  return call([&](int) {
    add(stream, {{}, event->happened, event->happened->size() - 1});
    return cudaSuccess;
  });
}
cudaError_t cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode) {
  return call([&](int) {
    stream->recorded = std::make_unique<std::vector<Work>>();
    return cudaSuccess;
  });
}
cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  const cudaError_t status = create(graph);
  if (status == cudaSuccess) (*graph)->work = std::move(*stream->recorded);
  stream->recorded.reset();
  return status;
}

cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned int) {
  return create(event);
}
cudaError_t cudaEventDestroy(cudaEvent_t event) {
  return destroy(event);
}
cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream) {
  const Happened happened = event->happened;
  return call([&](int) {
    require(event);
    const std::size_t time = happened->size();
    happened->push_back(0);
    add(stream, {[=] { (*happened)[time] = 1; }, nullptr, 0});
    return cudaSuccess;
  });
}
cudaError_t cudaEventSynchronize(cudaEvent_t event) {
  return call([&](int) {
    doUntil([=] { return event->happened->back() != 0; });
    return cudaSuccess;
  });
}
cudaError_t cudaEventElapsedTime(float* ms, cudaEvent_t, cudaEvent_t) {
  *ms = 0;
  return cudaSuccess;
}

cudaError_t cudaGraphInstantiate(cudaGraphExec_t* graph, cudaGraph_t from, unsigned long long) {
  const cudaError_t status = create(graph);
  if (status == cudaSuccess) (*graph)->work = from->work;
  return status;
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  return destroy(graph);
}
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t graph) {
  return destroy(graph);
}
cudaError_t cudaGraphLaunch(cudaGraphExec_t graph, cudaStream_t stream) {
  return call([&](int device) {
    require(graph);
    ++machine().devices[device].launches;
    ++machine().devices[device].replays;
    for (const Work& work : graph->work) add(stream, work);
    return cudaSuccess;
  });
}

cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags(int* blocks, const void*, int,
                                                                   std::size_t, unsigned int) {
  *blocks = 2;
  return cudaSuccess;
}

cudaError_t cudaGetDriverEntryPoint(const char* name, void** function, unsigned long long,
                                    cudaDriverEntryPointQueryResult*) {
  return driverFunction(name, function);
}
#if CUDART_VERSION >= 12050
cudaError_t cudaGetDriverEntryPointByVersion(const char* name, void** function, unsigned int,
                                             unsigned long long, cudaDriverEntryPointQueryResult*) {
  return driverFunction(name, function);
}
#endif

}  // extern "C"
