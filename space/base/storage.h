// Where buffers get their storage.
#pragma once

#include <atomic>
#include <cstddef>
#include <new>

#include "space/base/tuning.h"

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace ode_parallel_sap {

// Small storage is the heap's. From 256 bytes on it begins with a cache line. Large storage
// (least_mapped) is the system's own pages.
class Storage {
 public:
  static constexpr std::size_t unit = 16, least_aligned = 256;  // fixed: the heap's; a GroupFilter
  // What a wish for so many bytes is rounded up to.
  static std::size_t sizeFor(std::size_t bytes) {
    const std::size_t step = bytes < least_aligned ? unit : bytes < least_mapped ? line : page;
    return (bytes + step - 1) & ~(step - 1);
  }
  // `size` is that of sizeFor(). Throws std::bad_alloc.
  static void* allocate(std::size_t size) {
#if defined(__linux__)
    if (isMapped(size)) {
      void* const mapped =
          mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (mapped == MAP_FAILED) throw std::bad_alloc();
      return mapped;
    }
#endif
    return ::operator new(size, alignmentOf(size));
  }
  // `data` may be null.
  static void deallocate(void* data, std::size_t size) {
#if defined(__linux__)
    if (data && isMapped(size)) {
      if (const Watcher watcher = before_unmapping.load(std::memory_order_acquire)) watcher(data);
      munmap(data, size);
      return;
    }
#endif
    ::operator delete(data, alignmentOf(size));
  }

  // Called with each storage of the system's own pages before it goes, as long as it is set: a
  // device may have been given these pages.
  using Watcher = void (*)(void* data);
  inline static std::atomic<Watcher> before_unmapping{nullptr};

  // Whether storage of a size (that of sizeFor()) is the system's own pages. Sanitizers watch the
  // heap only.
  static bool isMapped(std::size_t size) {
#if !defined(__linux__) || defined(__SANITIZE_ADDRESS__)
    return (void)size, false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
    return (void)size, false;
#endif
#endif
    return size >= least_mapped;
  }

 private:
  static constexpr std::size_t line = 64, page = 4096;  // fixed: the machine's

  static std::align_val_t alignmentOf(std::size_t size) {
    return std::align_val_t{size < least_aligned ? unit : line};
  }
};

}  // namespace ode_parallel_sap
