// The CUDA back end as the space sees it, whether or not this build has one.
#ifndef ODE_PARALLEL_SAP_DEVICE_BACKEND_H
#define ODE_PARALLEL_SAP_DEVICE_BACKEND_H

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "space/data/pair_finder.h"
#include "space/frame/backend_choice.h"

namespace ode_parallel_sap {

// Whether this build has the back end and this machine a device for it. Loads the driver at the
// first call; a program that never asks for the back end never comes here.
bool deviceAvailable();

// One space's share of the devices.
class DeviceBackend {
 public:
  // What the user set.
  struct Wish {
    bool processor;  // may be chosen, too
    int devices;     // 0: chosen by the space
  };

  DeviceBackend();
  ~DeviceBackend();

  // On how many devices the next frame's pairs are found soonest; 0: on the processor. Where the
  // processor may be chosen, a device is only ever chosen after another thread has made it ready,
  // so that no frame waits for it.
  int choose(const BoxSet& boxes, const Wish& wish);
  // As PairFinder::find, on `devices` devices; returns how many found the pairs. 0, with nothing in
  // `pairs`, where devices do not take such boxes or all have failed: the caller then finds the
  // pairs itself. A device that fails is reported once through dMessage and not used again by this
  // space; one that cannot be made ready is not used by any.
  int find(const BoxSet& boxes, int threads, int devices, PairList& pairs);
  // The same by the method AxisLists, on up to so many devices, at least 1. Throws ListsTooLong
  // where the memory of one of them, or `most_bytes` unless that is 0, does not suffice.
  int findByAxisLists(const BoxSet& boxes, int threads, int devices, std::uint64_t most_bytes,
                      PairList& pairs);
  // What a frame took; `devices` as find() returned it. Has more devices made ready where they
  // would pay.
  void learn(const Wish& wish, int devices, std::size_t boxes, std::size_t pairs, double ms);
  std::size_t bytes() const;

 private:
  struct Finder;
  int lost() const;
  void reportFailures(const std::string& reason);
  template <class Work>
  int attempt(PairList& pairs, Work work);

  std::unique_ptr<Finder> finder_;
  BackendChoice choice_;
  bool failed_ = false;
};

}  // namespace ode_parallel_sap

#endif
