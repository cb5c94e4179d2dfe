// libFuzzer's entry: the bytes are the decisions.
#include <cstdio>
#include <cstdlib>

#include "driver.h"

namespace {
// Large enough for every way in which a space works, small enough for many inputs a second.
constexpr std::size_t kMostGeoms = 1200;
constexpr int kMostSteps = 120;
}  // namespace

// LLVM 14's OpenMP runtime leaves three blocks behind at the end, however many inputs were played.
// (Leaks of its threads go with them; long-run in the preset asan finds those.)
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libomp.so\n";
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace sap_test;
  static const bool ready = dInitODE2(0) && dAllocateODEDataForThread(dAllocateMaskAll);
  if (!ready) std::abort();
  Decisions decisions(bytes, size);
  Driver driver(decisions, kMostGeoms);
  for (int i = 0; i < kMostSteps && decisions.more() && driver.problem().empty(); ++i) {
    driver.step();
  }
  if (driver.problem().empty()) driver.finish();
  if (driver.problem().empty()) return 0;
  std::fputs(driver.problem().c_str(), stderr);
  std::abort();
}
