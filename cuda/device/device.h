// CUDA's resources as C++ objects, and its errors as exceptions.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <memory>
#include <new>
#include <utility>

#include "cuda/device/devices.h"
#include "cuda/device/memory_block.h"

struct CUctx_st;

namespace ode_parallel_sap {

// Throws DeviceFailure unless `status` is a success. `call` names the call in the message.
void checkCuda(cudaError_t status, const char* call);

// Whether this call is the one that a test wants to fail.
bool cudaCallIsToFail();

#define CHECK_CUDA(call)         \
  ::ode_parallel_sap::checkCuda( \
      ::ode_parallel_sap::cudaCallIsToFail() ? cudaErrorLaunchFailure : (call), #call)

int attributeOf(int device, cudaDeviceAttr attribute);

// What the driver keeps for the program on a device, whichever of its libraries has it made.
struct DriverContext {
  CUctx_st* handle = nullptr;
  int device = 0;
  unsigned long long id = 0;  // no other one ever has it
};

// That of the device which the runtime uses, too; made if there is none. It is kept for the rest of
// the program: to make one takes long.
DriverContext driverContextOf(int device);
// Whether the program has had it destroyed (cudaDeviceReset): nothing of it may be used or given
// back then.
bool isLost(const DriverContext& context) noexcept;
// Lets two devices read each other's memory. Throws DeviceFailure where they cannot.
void linkDevices(const DriverContext& one, const DriverContext& other);

// Makes a device's context current for the calling thread as long as it lives; the thread is as it
// was then. cudaSetDevice would not lead back: it makes the context of the device that it is given,
// which the program may never have used and which may have no room for one.
class ScopedDevice {
 public:
  explicit ScopedDevice(const DriverContext& context);
  // For giving back what is there: has no effect where it cannot have its own.
  ScopedDevice(const DriverContext& context, const std::nothrow_t&) noexcept;
  ~ScopedDevice();
  ScopedDevice(const ScopedDevice&) = delete;
  ScopedDevice& operator=(const ScopedDevice&) = delete;

 private:
  bool changed_ = false;
};

// What is kept on a device from frame to frame: made when it is first needed there.
template <class Context>
class OnDevice {
 public:
  explicit OnDevice(int device) : device_(device) {}
  OnDevice(OnDevice&&) = default;
  ~OnDevice() { release(); }

  int device() const { return device_; }
  // To be made current for all that uses what is there.
  const DriverContext& driverContext() {
    if (!context_) driver_context_ = driverContextOf(device_);
    return driver_context_;
  }
  // To be called before a frame: throws DeviceWasReset where that is so, whoever found it out.
  void checkContext() {
    if (isGone() && std::exchange(was_reset_, false)) throw DeviceWasReset();
  }
  void open() {
    if (!context_) context_ = std::make_unique<Context>(device_);
  }
  // Null before open() and after release().
  Context* context() { return context_.get(); }
  const Context* context() const { return context_.get(); }
  // Gives it back. Nothing is under way any more then.
  void release() {
    if (isGone()) return;
    const ScopedDevice device(driver_context_, std::nothrow);
    context_.reset();
  }

 protected:
  // What was on a device that the program has reset is not given back: its handles lead nowhere.
  bool isGone() {
    if (context_ && isLost(driver_context_)) {
      (void)context_.release();
      was_reset_ = true;
    }
    return !context_;
  }

  int device_;
  DriverContext driver_context_;
  std::unique_ptr<Context> context_;
  bool was_reset_ = false;  // and nobody was told
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

// Where kernels are started.
struct KernelQueue {
  cudaStream_t stream;
  int processors;  // of the device
};
// The same with memory for the time of one call.
struct ScratchQueue : KernelQueue {
  DeviceBuffer<char>& scratch;
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
