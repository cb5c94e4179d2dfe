// Prefetches what near callbacks read of geoms. Sees ODE's private headers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "space/base/pair_list.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/frame/stage_clock.h"
#include "space/frame/tuning.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// A callback that reads its geoms causes a cache miss a pair, as the later geom may lie anywhere.
// One that counts or stores pairs does not read them, and prefetching would only slow it down. The
// time of the first pairs of a stretch, without prefetching, decides.
class GeomsAhead {
 public:
  explicit GeomsAhead(dxGeom* const* geoms) : geoms_(geoms) {}

  // Calls call(pair) for these pairs, in their order.
  template <class Call>
  void report(const Pair* begin, const Pair* end, Call call) const {
    while (end - begin > tried_pairs) {
      const Pair* const stretch = begin + std::min(end - begin, stretch_pairs);
      fetch(begin, begin + tried_pairs);
      const Clock::time_point before = Clock::now();
      reportPlainly(begin, begin + tried_pairs, call);
      const double ms = milliseconds(before, Clock::now());
      begin += tried_pairs;
      if (ms > least_callback_ms * static_cast<double>(tried_pairs))
        reportAhead(begin, stretch, end, call);
      else
        reportPlainly(begin, stretch, call);
      begin = stretch;
    }
    reportPlainly(begin, end, call);
  }

 private:
  static constexpr std::ptrdiff_t step = prefetch_distance / 2;
  // Few of a stretch, as they wait, and enough for a clock.
  static constexpr std::ptrdiff_t stretch_pairs = chunk_pairs;
  static constexpr std::ptrdiff_t tried_pairs = stretch_pairs / 32;

  // So that what is waited for afterwards is waited for by the callback: threads that found the
  // pairs have them in their caches.
  void fetch(const Pair* begin, const Pair* end) const {
    for (; begin < end; ++begin)
      asm volatile("" : : "r"(geoms_[earlierOf(*begin)]), "r"(geoms_[laterOf(*begin)]));
  }
  template <class Call>
  static void reportPlainly(const Pair* begin, const Pair* end, Call call) {
    for (; begin < end; ++begin) call(*begin);
  }
  // There are pairs up to `last`.
  template <class Call>
  void reportAhead(const Pair* begin, const Pair* end, const Pair* last, Call call) const {
    for (; begin < end && last - begin > 4 * step; ++begin) {
      prefetch(&geoms_[laterOf(begin[4 * step])]);
      prefetchFor(geoms_[laterOf(begin[2 * step])], geoms_[laterOf(begin[step])]);
      call(*begin);
    }
    reportPlainly(begin, end, call);
  }
  // For a geom, and for what one that is nearer refers to: its body, and what the program hangs on
  // it, which need not be an address.
  static void prefetchFor(const dxGeom* far, const dxGeom* near) {
    constexpr std::uintptr_t least_address = 4096;  // fixed: nobody maps the first page
    prefetch(&far->body);
    if (near->body) prefetch(near->body);
    if (reinterpret_cast<std::uintptr_t>(near->data) >= least_address) prefetch(near->data);
  }

  dxGeom* const* const geoms_;
};

}  // namespace ode_parallel_sap
