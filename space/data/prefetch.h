// Asking for memory ahead of its use.
#pragma once

namespace ode_parallel_sap {

// Asks for the line of the cache that holds a place. To GCC (12) a function that does nothing else
// has no effect, and calls that it does not inline early are left out: all of the update's once
// were. With the empty statement there is one.
inline void prefetch(const void* place) {
  __builtin_prefetch(place);
  asm volatile("");
}
// The same for a place that will be written.
inline void prefetchForWriting(void* place) {
  __builtin_prefetch(place, 1);
  asm volatile("");
}

}  // namespace ode_parallel_sap
