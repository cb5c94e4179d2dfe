// Floating-point modes of threads: rounding, flushing of denormals, traps.
#pragma once

// A test goes the last of these ways, the C library's, on every processor.
#if defined(__SSE2__) && !defined(ODE_PARALLEL_SAP_C_LIBRARY_MODES)
#define ODE_PARALLEL_SAP_MXCSR
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace ode_parallel_sap {

#if defined(ODE_PARALLEL_SAP_MXCSR)
using FloatingPointMode = unsigned;
inline FloatingPointMode currentMode() {
  return _mm_getcsr();
}
inline void setMode(FloatingPointMode mode) {
  _mm_setcsr(mode);
}
// Nearest rounding, denormals kept, no traps.
inline FloatingPointMode exactMode() {
  return 0x1f80;
}
// Whether two modes differ in more than their sticky exception flags.
inline bool differs(FloatingPointMode a, FloatingPointMode b) {
  return ((a ^ b) & ~0x3fu) != 0;
}
#else
using FloatingPointMode = std::fenv_t;
inline FloatingPointMode currentMode() {
  FloatingPointMode mode;
  std::fegetenv(&mode);
  return mode;
}
inline void setMode(const FloatingPointMode& mode) {
  std::fesetenv(&mode);
}
// The environment in which a program starts. FE_DFL_ENV can only be set, so the first caller does.
inline const FloatingPointMode& exactMode() {
  static const FloatingPointMode mode = [] {
    const FloatingPointMode before = currentMode();
    std::fesetenv(FE_DFL_ENV);
    const FloatingPointMode found = currentMode();
    setMode(before);
    return found;
  }();
  return mode;
}
// What an environment consists of is the C library's business.
inline bool differs(const FloatingPointMode&, const FloatingPointMode&) {
  return true;
}
#endif

// Holds a mode for the calling thread as long as it lives. ODE's own computations run in the mode
// of the thread that called the space, on every thread; comparisons and roundings of this library
// run in exactMode(), whatever the program was compiled with.
class ScopedMode {
 public:
  explicit ScopedMode(const FloatingPointMode& mode)
      : before_(currentMode()), changed_(differs(before_, mode)) {
    if (changed_) setMode(mode);
  }
  ~ScopedMode() {
    if (changed_) setMode(before_);
  }
  ScopedMode(const ScopedMode&) = delete;
  ScopedMode& operator=(const ScopedMode&) = delete;

 private:
  const FloatingPointMode before_;
  const bool changed_;
};

}  // namespace ode_parallel_sap
