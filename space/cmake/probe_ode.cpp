// Run before anything is known about the ODE that was found: what its headers say, what the library
// says, where in a body its flags are. Uses the public interface only.
#include <ode/ode.h>

#include <cstddef>
#include <cstdio>
#include <cstring>

namespace {

// The first byte of a body that disabling it changes.
std::size_t placeOfBodyFlags() {
  constexpr std::size_t looked_at = 128;  // a body has more
  unsigned char before[looked_at], after[looked_at];
  dWorldID world = dWorldCreate();
  dBodyID body = dBodyCreate(world);
  std::memcpy(before, static_cast<void*>(body), looked_at);
  dBodyDisable(body);
  std::memcpy(after, static_cast<void*>(body), looked_at);
  dWorldDestroy(world);
  std::size_t place = 0;
  while (place < looked_at && before[place] == after[place]) ++place;
  return place < looked_at ? place : 0;
}

}  // namespace

#if !defined(dODE_VERSION)
#define dODE_VERSION "unknown"
#endif

int main() {
  dInitODE2(0);
#if defined(dDOUBLE)
  const char* headers = "DOUBLE";
#else
  const char* headers = "SINGLE";
#endif
  const char* library = dCheckConfiguration("ODE_double_precision") ? "DOUBLE" : "SINGLE";
  int has_tls = dCheckConfiguration("ODE_EXT_mt_collisions");
  std::printf("%s;%s;%s;%d;%zu", dODE_VERSION, headers, library, has_tls, placeOfBodyFlags());
  dCloseODE();
  return 0;
}
