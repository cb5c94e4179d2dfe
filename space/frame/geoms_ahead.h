// Prefetches what near callbacks read of geoms. Sees ODE's private headers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "space/base/pair_list.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/frame/stage_clock.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// For a geom, and for what one that is nearer refers to: its body, and what the program hangs on
// it, which need not be an address.
inline void prefetchForCallback(const dxGeom* far, const dxGeom* near) {
  constexpr std::uintptr_t least_address = 4096;  // fixed: nobody maps the first page
  prefetch(&far->body);
  if (near->body) prefetch(near->body);
  if (reinterpret_cast<std::uintptr_t>(near->data) >= least_address) prefetch(near->data);
}

// Calls call(pair) for all pairs, in their order. A callback that reads its geoms causes a cache
// miss a pair, as the later geom may lie anywhere. One that counts or stores pairs does not read
// them, and prefetching would only slow it down. The time of the first pairs of each stretch,
// without prefetching, decides.
template <class Call>
void reportPairs(const PairList& pairs, dxGeom* const* geoms, Call call) {
  constexpr std::ptrdiff_t step = prefetch_distance / 2, stretch_pairs = chunk_pairs;
  constexpr std::ptrdiff_t tried_pairs = stretch_pairs / 32;  // as they wait; enough for a clock
  for (const Buffer<Pair>& part : pairs.parts) {
    const Pair *pair = part.begin(), *const end = part.end();
    while (end - pair > tried_pairs) {
      const Pair *const tried = pair + tried_pairs, *const stretch =
                                                        pair + std::min(end - pair, stretch_pairs);
      // The callback is not to wait for what threads that found the pairs have in their caches.
      for (const Pair* next = pair; next < tried; ++next)
        asm volatile("" : : "r"(geoms[earlierOf(*next)]), "r"(geoms[laterOf(*next)]));
      const Clock::time_point before = Clock::now();
      for (; pair < tried; ++pair) call(*pair);
      if (milliseconds(before, Clock::now()) > least_callback_ms * static_cast<double>(tried_pairs))
        for (; pair < stretch && end - pair > 4 * step; ++pair) {
          prefetch(&geoms[laterOf(pair[4 * step])]);
          prefetchForCallback(geoms[laterOf(pair[2 * step])], geoms[laterOf(pair[step])]);
          call(*pair);
        }
      for (; pair < stretch; ++pair) call(*pair);
    }
    for (; pair < end; ++pair) call(*pair);
  }
}

}  // namespace ode_parallel_sap
