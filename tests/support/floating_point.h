// Floating-point modes a program may run in, on processors where they can be set.
#pragma once

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace sap_test {

// Sets a mode for the calling thread while it lives.
class FloatingPointMode {
 public:
#if defined(__SSE2__)
  static constexpr bool kCanBeSet = true;
  static constexpr unsigned kDefault = 0x1f80;  // nearest, denormals kept, nothing traps
  static constexpr unsigned kFlushing = kDefault | 0x8040;  // what -ffast-math sets at start
  static constexpr unsigned kDownward = kDefault | 0x2000;
  static constexpr unsigned kUpward = kDefault | 0x4000;
  static constexpr unsigned kTowardZero = kDefault | 0x6000;
  // Invalid operations, divisions by zero and overflows raise SIGFPE: feenableexcept's usual three.
  static constexpr unsigned kTrapping = kDefault & ~0x0680u;

  // The sticky flags are nobody's setting.
  static unsigned current() {
    return _mm_getcsr() & ~0x3fu;
  }
#elif defined(__aarch64__)
  static constexpr bool kCanBeSet = true;
  static constexpr unsigned kDefault = 0;
  static constexpr unsigned kFlushing = 1u << 24;
  static constexpr unsigned kDownward = 2u << 22;
  static constexpr unsigned kUpward = 1u << 22;
  static constexpr unsigned kTowardZero = 3u << 22;
  static constexpr unsigned kTrapping = 7u << 8;  // most processors know no traps

  static unsigned current() {
    unsigned long long mode;
    __asm__ volatile("mrs %0, fpcr" : "=r"(mode) : : "memory");
    return static_cast<unsigned>(mode);
  }
#else
  static constexpr bool kCanBeSet = false;
  static constexpr unsigned kDefault = 0, kFlushing = 0, kDownward = 0, kUpward = 0,
                            kTowardZero = 0, kTrapping = 0;
  static unsigned current() {
    return 0;
  }
#endif
  explicit FloatingPointMode(unsigned mode) : before_(current()) {
    set(mode);
  }
  ~FloatingPointMode() {
    set(before_);
  }
  FloatingPointMode(const FloatingPointMode&) = delete;
  FloatingPointMode& operator=(const FloatingPointMode&) = delete;

 private:
  static void set(unsigned mode) {
#if defined(__SSE2__)
    _mm_setcsr(mode);
#elif defined(__aarch64__)
    __asm__ volatile("msr fpcr, %0" : : "r"(0ull + mode) : "memory");
#else
    static_cast<void>(mode);
#endif
  }

  const unsigned before_;
};

}  // namespace sap_test
