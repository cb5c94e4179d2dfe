// Asking for memory ahead of its use.
#pragma once

namespace ode_parallel_sap {

// Asks for the line of the cache that holds a place. To GCC (12) a function that does nothing else
// has no effect, and calls of such functions that it does not inline early are left out: all of the
// update's once were. With the empty statement there is one.
[[gnu::always_inline]] inline void prefetch(const void* place) {
  __builtin_prefetch(place);
  asm volatile("");
}
// The same, but no nearer than the second-level cache: where much is asked for that comes from
// memory, there is room for few lines on their way to the first.
[[gnu::always_inline]] inline void prefetchFar(const void* place) {
  __builtin_prefetch(place, 0, 2);
  asm volatile("");
}
// The same as the first for a place that will be written.
[[gnu::always_inline]] inline void prefetchForWriting(void* place) {
  __builtin_prefetch(place, 1);
  asm volatile("");
}

}  // namespace ode_parallel_sap
