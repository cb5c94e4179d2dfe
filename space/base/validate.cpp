#include "space/base/validate.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace ode_parallel_sap {

void mustHold(bool holds, const char* invariant) {
  if (holds) return;
  std::fprintf(stderr, "parallel SAP space: broken invariant: %s\n", invariant);
  std::abort();
}

void PairList::validate(std::size_t slots) const {
  constexpr char invariant[] =
      "runs lie in the parts, and their pairs ascend, each once, unmarked, the earlier slot first";
  Pair least = 0;
  for (const Run& run : runs) {
    mustHold(std::any_of(parts.begin(), parts.end(),
                         [&](const Buffer<Pair>& part) {
                           return part.begin() <= run.begin() && run.end() <= part.end();
                         }),
             invariant);
    for (const Pair pair : run) {
      mustHold(pair >= least && earlierOf(pair) < laterOf(pair) && laterOf(pair) < slots &&
                   !isMarkedBorderline(pair),
               invariant);
      least = pair + 1;
    }
  }
}

}  // namespace ode_parallel_sap
