// What depends on the operating system or the compiler, but for images of ODE (space/images), pages
// of the system's (buffer.h) and vectors (simd).
#pragma once

#include <cstdint>

namespace ode_parallel_sap {

// Fetches the line of the cache that holds a place. Without the empty statement GCC 12 takes
// functions that only prefetch for functions without effect, and leaves out their calls.
[[gnu::always_inline]] inline void prefetch(const void* place) {
  __builtin_prefetch(place);
  asm volatile("");
}
// The same into the second-level cache: few lines at a time may be on their way to the first.
[[gnu::always_inline]] inline void prefetchFar(const void* place) {
  __builtin_prefetch(place, 0, 2);
  asm volatile("");
}

// Bytes that can be taken without another program giving any up; 0 where that is not known. On
// Linux it takes some ten microseconds.
std::uint64_t freeMemory();

// Bytes that this process may still map by its limit of address space (ulimit -v).
std::uint64_t freeAddressSpace();

// Calls these functions, each of which may be null, whenever the process forks: before, then in the
// parent and in the child. Windows has no fork.
void onFork(void (*before)(), void (*in_parent)(), void (*in_child)());

// The process's variables, NAME=VALUE, up to a null.
char** environment();

// The number that the system gives to this process.
long processNumber();

// A thread that was joined counts against limits until the system has removed it. On Linux
// threadNumber() is that of the calling thread, and awaitRemoval() waits for up to 0.1 s.
long threadNumber();
void awaitRemoval(long thread);

}  // namespace ode_parallel_sap
