#define CATCH_CONFIG_RUNNER
#include <ode/ode.h>

#include <cstdio>

#include "catch.hpp"
#include "configurations.h"
#include "contact_scene.h"
#include "ode_errors.h"
#include "scenes.h"

namespace {

// CTest shows a test that ends with this as skipped (SKIP_RETURN_CODE in CMakeLists.txt).
constexpr int kSkipped = 77;

int run(int argc, char** argv) {
  if (!sap_test::anyConfigurationAskedFor()) {
    std::fprintf(stderr, "SKIPPED: all of it\n");
    return kSkipped;
  }
  const int failed = Catch::Session().run(argc, argv);
  // Not taken for "skipped", and not for success where it is a multiple of 256.
  return failed == 0 ? 0 : 1;
}

}  // namespace

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
// The OpenMP runtime is not instrumented, and its own locks are none of our business; what our code
// does between its teams is, and Archer tells of those.
extern "C" const char* __tsan_default_options();
extern "C" const char* __tsan_default_options() {
  return "ignore_noninstrumented_modules=1";
}
#endif
#endif

int main(int argc, char** argv) {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  sap_test::throwOdeErrors();
  const int result = run(argc, argv);
  sap_test::releaseShapes();
  sap_test::releaseContactShapes();
  dCloseODE();
  return result;
}
