// A CUDA runtime, with what the library calls of its driver, for machines without a GPU: linked in
// place of the real one. It keeps the real one's rules of devices, contexts and threads, copies
// memory, and counts. Kernels do nothing, so frames on its devices have no pairs: it shows what the
// library asks of which device, not what comes of it.
//
// The rules, as the manuals of runtime and driver have them:
// - Each thread has a stack of contexts, the top one of which is current, and a device number, 0 at
//   first.
// - A call that works on a device takes the current context. Where there is none it takes the
//   primary context of the device number, which is made if it does not exist.
// - cudaSetDevice sets the number and makes that device's primary context, and makes it current.
// - A context takes memory on its device: none can be made on a device that is full.
#pragma once

#include <cstddef>
#include <string>
#include <tuple>

namespace sap_test {

class FakeCuda {
 public:
  struct Device {
    bool full = false;
    int generation = 9;  // the major number of its compute capability
    int linked = 0;      // to others whose memory it may read
    int asked_links = 0;
    int tried = 0;  // to make its context
    bool has_context = false;
    long in_use = 0;   // of what was allocated or created on it and still is
    int launches = 0;  // of kernels and graphs
  };

  // The machine from now on, the driver not having been asked before: a letter a device, `f` full,
  // `o` of an older generation.
  static void setDevices(const std::string& devices);
  static Device device(int number);
  // Whether devices may read each other's memory, which they may at first.
  static void allowLinks(bool allowed);
  // Calls that worked on a device although the thread had made no context current: those of a
  // program that leaves the choice to the runtime.
  static int callsWithoutContext();

  // Host memory whose pages are locked: how often that was asked for, and what is now.
  struct Locks {
    int asked = 0;
    std::size_t now = 0;
  };
  static Locks locks();
  // Whether to let pages be locked, which it does at first.
  static void allowLocks(bool allowed);

  // Of the calling thread: its device, its context, and how many are on its stack.
  static std::tuple<int, const void*, std::size_t> current();
  // As a program with a context of its own has it: cuCtxCreate.
  static const void* createContext(int device);
};

}  // namespace sap_test
