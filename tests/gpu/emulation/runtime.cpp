#include "tests/gpu/emulation/runtime.h"

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "cuda/device/device.h"
#include "cuda/device/devices.h"
#include "cuda/device/page_locks.h"

// What the runtime's opaque types are here. An event has happened as often as it was recorded on a
// stream that has come so far. Events stay until the program ends, as work may still name them.
struct CUevent_st {
  std::vector<char> happened{1};
};

namespace emulation {
namespace {

struct Work {
  std::function<void()> work;  // or, if empty:
  cudaEvent_t event = nullptr;
  std::size_t time = 0;  // which of its records is waited for
  bool canBegin() const { return !event || event->happened[time]; }
};

}  // namespace
}  // namespace emulation

struct CUstream_st {
  int device;
  std::uint64_t priority;
  std::deque<emulation::Work> work;
  std::unique_ptr<std::vector<emulation::Work>> recorded;  // while it is captured
};
struct CUgraph_st {
  std::vector<emulation::Work> work;
};
struct CUgraphExec_st {
  std::vector<emulation::Work> work;
};

namespace emulation {
namespace {

std::vector<CUstream_st*> streams;
std::unordered_map<void*, std::size_t> memory;  // bytes, by where it begins
int current_device = 0;

// Does a piece of work of any stream, most often of the one that is ahead of others. False where
// there is none, or all wait.
bool step() {
  std::vector<CUstream_st*> ready;
  for (CUstream_st* stream : streams)
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
  if (stream->recorded)
    stream->recorded->push_back(std::move(work));
  else
    stream->work.push_back(std::move(work));
}

void waitForDevice() {
  for (CUstream_st* stream : streams)
    if (stream->device == current_device) doUntil([=] { return stream->work.empty(); });
}

// Full of anything, and no larger than asked for: so that a sanitizer sees what is beyond.
void* newMemory(std::size_t bytes) {
  ode_parallel_sap::checkCuda(cudaSuccess, "allocation");
  void* at = nullptr;
  if (posix_memalign(&at, 256, std::max<std::size_t>(bytes, 1))) std::abort();
  std::memset(at, static_cast<int>(random().below(256)), bytes);
  return at;
}

}  // namespace

sap_test::Random& random() {
  static sap_test::Random numbers(1);
  return numbers;
}
void seed(std::uint64_t seed) {
  random() = sap_test::Random(seed);
}
Machine& machine() {
  static Machine it;
  return it;
}
void push(cudaStream_t stream, std::function<void()> work) {
  add(stream, {std::move(work), nullptr, 0});
}
cudaError_t pushWithScratch(void* scratch, std::size_t& bytes, std::size_t needed,
                            cudaStream_t stream, std::function<void()> work) {
  if (!scratch) {
    bytes = needed;
    return cudaSuccess;
  }
  push(stream, [=, size = bytes] { std::memset(scratch, 0x5a, size); });
  push(stream, std::move(work));
  return cudaSuccess;
}
void shuffleStreams() {
  for (CUstream_st* stream : streams) stream->priority = random().bits();
}
std::size_t pending() {
  std::size_t pieces = 0;
  for (const CUstream_st* stream : streams) pieces += stream->work.size();
  return pieces;
}

}  // namespace emulation

using namespace emulation;

extern "C" {

cudaError_t cudaGetLastError() {
  return cudaSuccess;
}

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned) {
  streams.push_back(new CUstream_st{current_device, emulation::random().bits(), {}, nullptr});
  *stream = streams.back();
  return cudaSuccess;
}
cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
  doUntil([=] { return stream->work.empty(); });
  return cudaSuccess;
}
cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  streams.erase(std::find(streams.begin(), streams.end(), stream));
  delete stream;
  return cudaSuccess;
}
cudaError_t cudaStreamWaitEvent(cudaStream_t stream, cudaEvent_t event, unsigned) {
  add(stream, {{}, event, event->happened.size() - 1});
  return cudaSuccess;
}

cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned) {
  static std::vector<std::unique_ptr<CUevent_st>> events;
  events.push_back(std::make_unique<CUevent_st>());
  *event = events.back().get();
  return cudaSuccess;
}
cudaError_t cudaEventDestroy(cudaEvent_t) {
  return cudaSuccess;
}
cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream) {
  const std::size_t time = event->happened.size();
  event->happened.push_back(0);
  push(stream, [=] { event->happened[time] = 1; });
  return cudaSuccess;
}
cudaError_t cudaEventSynchronize(cudaEvent_t event) {
  doUntil([=] { return event->happened.back() != 0; });
  return cudaSuccess;
}

cudaError_t cudaFree(void* at) {
  waitForDevice();
  machine().held -= memory[at];
  memory.erase(at);
  std::free(at);
  return cudaSuccess;
}
cudaError_t cudaFreeHost(void* at) {
  waitForDevice();
  std::free(at);
  return cudaSuccess;
}
cudaError_t cudaMemcpyAsync(void* to, const void* from, size_t bytes, cudaMemcpyKind,
                            cudaStream_t stream) {
  push(stream, [=] { std::memcpy(to, from, bytes); });
  return cudaSuccess;
}
cudaError_t cudaMemcpyPeerAsync(void* to, int, const void* from, int, size_t bytes,
                                cudaStream_t stream) {
  push(stream, [=] { std::memcpy(to, from, bytes); });
  return cudaSuccess;
}
cudaError_t cudaMemsetAsync(void* to, int value, size_t bytes, cudaStream_t stream) {
  push(stream, [=] { std::memset(to, value, bytes); });
  return cudaSuccess;
}

cudaError_t cudaDeviceCanAccessPeer(int* can, int device, int other) {
  *can = machine().some_peers ? (device + 2 * other) % 3 != 0 : machine().peers_readable;
  return cudaSuccess;
}
cudaError_t cudaDeviceEnablePeerAccess(int, unsigned) {
  return cudaSuccess;
}

cudaError_t cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode) {
  stream->recorded = std::make_unique<std::vector<Work>>();
  return cudaSuccess;
}
cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  *graph = new CUgraph_st{std::move(*stream->recorded)};
  stream->recorded.reset();
  return cudaSuccess;
}
cudaError_t cudaGraphInstantiate(cudaGraphExec_t* graph, cudaGraph_t from, unsigned long long) {
  *graph = new CUgraphExec_st{from->work};
  return cudaSuccess;
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  delete graph;
  return cudaSuccess;
}
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t graph) {
  delete graph;
  return cudaSuccess;
}
cudaError_t cudaGraphLaunch(cudaGraphExec_t graph, cudaStream_t stream) {
  ++machine().replays;
  for (const Work& work : graph->work) add(stream, work);
  return cudaSuccess;
}

cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags(int* blocks, const void*, int,
                                                                   size_t, unsigned) {
  *blocks = 2;
  return cudaSuccess;
}

}  // extern "C"

// cuda/device/device.cpp and page_locks.cpp, which ask the driver.
namespace ode_parallel_sap {

namespace {

int numberOf(DriverContext context) {
  return static_cast<int>(reinterpret_cast<std::size_t>(context)) - 1;
}

std::vector<int> devices_before;

}  // namespace

void checkCuda(cudaError_t status, const char* call) {
  if (machine().fail_call > 0 && --machine().fail_call == 0) throw DeviceFailure(call);
  if (status != cudaSuccess) throw DeviceFailure(call);
}
bool cudaCallIsToFail() {
  return false;
}
int processorsOf(int) {
  return 1 + static_cast<int>(emulation::random().below(2));
}
DriverContext driverContextOf(int device) {
  return reinterpret_cast<DriverContext>(static_cast<std::size_t>(device) + 1);
}

ScopedDevice::ScopedDevice(DriverContext context) : changed_(true) {
  devices_before.push_back(std::exchange(current_device, numberOf(context)));
}
ScopedDevice::ScopedDevice(DriverContext context, const std::nothrow_t&) noexcept
    : ScopedDevice(context) {}
ScopedDevice::~ScopedDevice() {
  if (!changed_) return;
  current_device = devices_before.back();
  devices_before.pop_back();
}

void* DeviceMemory::allocate(std::size_t bytes) {
  void* const at = newMemory(bytes);
  memory[at] = bytes;
  machine().held += bytes;
  return at;
}
void* PinnedMemory::allocate(std::size_t bytes) {
  return newMemory(bytes);
}
void PageLock::lock(const void*, std::size_t) {}

}  // namespace ode_parallel_sap
