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

  explicit FloatingPointMode(unsigned mode) : before_(_mm_getcsr()) {
    _mm_setcsr(mode);
  }
  ~FloatingPointMode() {
    _mm_setcsr(before_);
  }
  // The sticky flags are nobody's setting.
  static unsigned current() {
    return _mm_getcsr() & ~0x3fu;
  }
#else
  static constexpr bool kCanBeSet = false;
  static constexpr unsigned kDefault = 0, kFlushing = 0, kDownward = 0, kUpward = 0,
                            kTowardZero = 0, kTrapping = 0;
  explicit FloatingPointMode(unsigned) {}
  ~FloatingPointMode() {}
  static unsigned current() {
    return 0;
  }
#endif
  FloatingPointMode(const FloatingPointMode&) = delete;
  FloatingPointMode& operator=(const FloatingPointMode&) = delete;

 private:
#if defined(__SSE2__)
  const unsigned before_;
#endif
};

}  // namespace sap_test
