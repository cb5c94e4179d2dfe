// A CUDA runtime, with what the library calls of its driver, for machines without a GPU: linked in
// place of the real one. It keeps the real one's rules of contexts and threads, and counts. Work of
// its streams is done in an order that nobody would expect, as late as it may be.
//
// The rules, as the manuals of runtime and driver have them:
// - Each thread has a stack of contexts, the top one of which is current.
// - A call that works on a device takes the current context. Where there is none it takes the
//   primary context of device 0, which is made if it does not exist.
// - A context takes memory on its device: none can be made on a device that is full.
#pragma once

#include <driver_types.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>

#include "support/random.h"

namespace emulation {

struct Device {
  bool full = false;
  int generation = 9;  // the major number of its compute capability
  int linked = 0;      // to others whose memory it may read
  int asked_links = 0;
  int tried = 0;  // to make its context
  bool has_context = false;
  long in_use = 0;   // of what was allocated or created on it and still is
  int launches = 0;  // of kernels and graphs
  int replays = 0;   // of graphs
};

// The machine from now on, the driver not having been asked before: a letter a device, `f` full,
// `o` of an older generation, `x` of one that is too old. "no-driver": there is none.
void setDevices(const std::string& devices);
Device device(int number);
void setFull(int device, bool full);
// The allocation-th one from now on, on a device or of pinned memory, finds no memory; 0: none.
void failAllocation(unsigned long long allocation);
// As cudaDeviceReset: all that is on the device is gone, and a handle of it ends the program.
void reset(int device);
// Calls that worked on a device although the thread had made no context current: those of a program
// that leaves the choice to the runtime.
int callsWithoutContext();
// Bytes of device memory.
std::size_t memoryHeld();

// Host memory whose pages are locked: how often that was asked for, and what is now.
struct Locks {
  int asked = 0;
  std::size_t now = 0;
};
Locks locks();
// Bytes that were copied between the host and devices so far.
std::size_t copiedBytes();

// Of the calling thread: its context, and how many are on its stack.
std::pair<const void*, std::size_t> contextOfThread();
// As a program with a context of its own has it: cuCtxCreate.
void createContext(int device);

// How the machine is, for tests to set.
struct Settings {
  // Otherwise kernels do nothing and memory is full of zeros, so that frames have no pairs: that
  // shows what the library asks of which device, not what comes of it.
  bool kernels_run = false;
  bool locks_allowed = true;
  std::atomic<bool> contexts_wait{false};  // to make one takes until this is false
  // Which devices may read each other's memory: refused where the driver says so only when asked to
  // let them.
  enum { All, None, Refused } links = All;
};
Settings& settings();

// What decides in which order things happen. The same seed, the same order.
sap_test::Random& random();
// Some streams lag behind from now on, until they are waited for.
void shuffleStreams();
// Pieces of work that nobody has waited for.
std::size_t pending();

// Adds a kernel to a stream.
cudaError_t launch(cudaStream_t stream, std::function<void()> work);
// The same as CUB does: asked without scratch memory it says how much there has to be, a byte more
// than `needed`; afterwards that is full of anything.
cudaError_t launchWithScratch(void* scratch, std::size_t& bytes, std::size_t needed,
                              cudaStream_t stream, std::function<void()> work);

}  // namespace emulation
