// The CUDA runtime of devices that are emulated: streams whose work is done in an order that nobody
// would expect, as late as it may be, and memory that is full of anything at first.
#pragma once

#include <driver_types.h>

#include <cstddef>
#include <functional>

#include "tests/support/random.h"

namespace emulation {

// What decides in which order things happen. The same seed, the same order.
sap_test::Random& random();
void seed(std::uint64_t seed);

// Adds work to a stream.
void push(cudaStream_t stream, std::function<void()> work);

// The same as CUB does: asked without scratch memory it says how much there has to be; afterwards
// that is full of anything.
cudaError_t pushWithScratch(void* scratch, std::size_t& bytes, std::size_t needed,
                            cudaStream_t stream, std::function<void()> work);

// How the machine is, for tests to set.
struct Machine {
  bool peers_readable = true;  // or none, or, where `some_peers` is set, some
  bool some_peers = false;
  int fail_call = 0;        // the call-th from now on fails; 0: none
  std::size_t held = 0;     // bytes of device memory
  std::size_t replays = 0;  // of graphs
};
Machine& machine();

// Some streams lag behind from now on, until they are waited for.
void shuffleStreams();
// Pieces of work that nobody has waited for.
std::size_t pending();

}  // namespace emulation
