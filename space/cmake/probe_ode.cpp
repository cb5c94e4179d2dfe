// Run before anything is known about the ODE that was found: what its headers say and what the
// library says. Uses the public interface only.
#include <ode/ode.h>

#include <cstdio>

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
  std::printf("%s;%s;%s;%d", dODE_VERSION, headers, library, has_tls);
  dCloseODE();
  return 0;
}
