// A call that GCC leaves out if prefetch() has no effect in its eyes: of a function that only asks,
// and is not inlined.
#include "space/data/prefetch.h"

namespace {

[[gnu::noinline]] void ask(const void* place) {
  ode_parallel_sap::prefetch(place);
}

}  // namespace

void askForAll(const void* const* places, int count);
void askForAll(const void* const* places, int count) {
  for (int i = 0; i < count; ++i) ask(places[i]);
}
