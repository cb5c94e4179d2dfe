// What near callbacks read of geoms, asked for before they are called.
#pragma once

#include <ode/ode.h>

#include <algorithm>
#include <cstddef>

#include "space/base/pair_list.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/frame/stage_clock.h"
#include "space/frame/tuning.h"

namespace ode_parallel_sap {

// A callback that looks at its geoms waits for memory with each pair, as the later one may be
// anywhere; one that counts or stores pairs does not touch them, and would wait only for what is
// asked for in vain. What the first pairs of a stretch take without says which it is.
class GeomsAhead {
 public:
  explicit GeomsAhead(dxGeom* const* geoms) : geoms_(geoms) {}

  // Calls call(pair) for these pairs, in their order.
  template <class Call>
  void tell(const Pair* begin, const Pair* end, Call call) const {
    while (end - begin > tried_pairs) {
      const Pair* const stretch = begin + std::min(end - begin, stretch_pairs);
      fetch(begin, begin + tried_pairs);
      const Clock::time_point before = Clock::now();
      tellPlainly(begin, begin + tried_pairs, call);
      const double ms = milliseconds(before, Clock::now());
      begin += tried_pairs;
      if (ms > least_callback_ms * static_cast<double>(tried_pairs))
        tellAhead(begin, stretch, end, call);
      else
        tellPlainly(begin, stretch, call);
      begin = stretch;
    }
    tellPlainly(begin, end, call);
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
  static void tellPlainly(const Pair* begin, const Pair* end, Call call) {
    for (; begin < end; ++begin) call(*begin);
  }
  // There are pairs up to `last`.
  template <class Call>
  void tellAhead(const Pair* begin, const Pair* end, const Pair* last, Call call) const {
    for (; begin < end && last - begin > 4 * step; ++begin) {
      prefetch(&geoms_[laterOf(begin[4 * step])]);
      askFor(geoms_[laterOf(begin[2 * step])], geoms_[laterOf(begin[step])]);
      call(*begin);
    }
    tellPlainly(begin, end, call);
  }
  // For a geom, and for what one that is nearer refers to.
  static void askFor(const dxGeom* far, const dxGeom* near);

  dxGeom* const* const geoms_;
};

}  // namespace ode_parallel_sap
