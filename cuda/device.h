// CUDA's resources as C++ objects, and its errors as exceptions.
#ifndef ODE_PARALLEL_SAP_CUDA_DEVICE_H
#define ODE_PARALLEL_SAP_CUDA_DEVICE_H

#include <cuda_runtime_api.h>

#include <cstddef>
#include <utility>

#include "memory_block.h"

namespace ode_parallel_sap {

// Throws DeviceFailure unless `status` is a success. `call` names the call in the message.
void checkCuda(cudaError_t status, const char* call);

// Whether this call is the one that a test wants to fail.
bool cudaCallIsToFail();

#define CHECK_CUDA(call)         \
  ::ode_parallel_sap::checkCuda( \
      ::ode_parallel_sap::cudaCallIsToFail() ? cudaErrorLaunchFailure : (call), #call)

// Makes a device current for the calling thread as long as it lives.
class ScopedDevice {
 public:
  explicit ScopedDevice(int device) {
    CHECK_CUDA(cudaGetDevice(&before_));
    if (before_ != device) CHECK_CUDA(cudaSetDevice(device));
    changed_ = before_ != device;
  }
  ~ScopedDevice() {
    if (changed_) cudaSetDevice(before_);
  }
  ScopedDevice(const ScopedDevice&) = delete;
  ScopedDevice& operator=(const ScopedDevice&) = delete;

 private:
  int before_ = 0;
  bool changed_ = false;
};

struct DeviceMemory {
  static void* allocate(std::size_t bytes);
  static void release(void* memory) { cudaFree(memory); }
};
// Page-locked host memory, which the device reads and writes at full speed.
struct PinnedMemory {
  static void* allocate(std::size_t bytes);
  static void release(void* memory) { cudaFreeHost(memory); }
};

// Growing one of these waits for the device.
template <class T>
using DeviceBuffer = MemoryBlock<T, DeviceMemory>;
template <class T>
using PinnedBuffer = MemoryBlock<T, PinnedMemory>;

class Stream {
 public:
  Stream() { CHECK_CUDA(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  // What is still under way may read memory that is about to be freed.
  ~Stream() {
    cudaStreamSynchronize(stream_);
    cudaStreamDestroy(stream_);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

class Event {
 public:
  enum Kind { Order, Time };
  explicit Event(Kind kind = Order) {
    CHECK_CUDA(cudaEventCreateWithFlags(&event_,
                                        kind == Time ? cudaEventDefault : cudaEventDisableTiming));
  }
  ~Event() { cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  operator cudaEvent_t() const { return event_; }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace ode_parallel_sap

#endif
