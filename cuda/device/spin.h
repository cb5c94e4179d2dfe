// Waits for another thread that is expected within microseconds.
#pragma once

#include <thread>

#include "cuda/device/tuning.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace ode_parallel_sap {

// Gives the core away after a while, as there may be more threads than cores.
template <class Done>
inline void spinUntil(Done done) {
  for (int i = 0; !done(); ++i) {
    if (i > device::spins_before_yield) std::this_thread::yield();
#if defined(__SSE2__)
    _mm_pause();
#endif
  }
}

}  // namespace ode_parallel_sap
