// The pairs of a frame, as the program gets them: one by one, or in the blocks of
// dParallelSAPSpaceCollidePairs.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "space/base/pair_list.h"
#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/frame/statistics.h"
#include "space/frame/without_memory.h"
#include "space/geoms/ode_private.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

// For a geom, and for what one that is nearer refers to: its body, and what the program hangs on
// it, which need not be an address.
inline void prefetchForCallback(const dxGeom* far, const dxGeom* near) {
  constexpr std::uintptr_t least_address = 4096;  // fixed: nobody maps the first page
  prefetch(&far->body);
  if (near->body) prefetch(near->body);
  if (reinterpret_cast<std::uintptr_t>(near->data) >= least_address) prefetch(near->data);
}

// How many pairs ahead of the callback the list is prefetched, and the body and data of a geom. The
// geom is prefetched twice as far ahead, its entry in the table four times.
constexpr std::ptrdiff_t pairs_ahead = 16 * prefetch_distance, geoms_ahead = prefetch_distance / 2;

// Pairs of slots, whose geoms are in a table.
struct PairsBySlot {
  dxGeom* const* geoms;

  dParallelSAPPair of(const Pair* pair) const {
    return {geoms[earlierOf(*pair)], geoms[laterOf(*pair)]};
  }
  void prefetchAhead(const Pair* pair, bool reads) const {
    prefetch(pair + pairs_ahead);
    prefetch(&geoms[laterOf(pair[4 * geoms_ahead])]);
    if (reads)
      prefetchForCallback(geoms[laterOf(pair[2 * geoms_ahead])], geoms[laterOf(pair[geoms_ahead])]);
  }
};

// Pairs whose geoms threads have resolved.
struct ResolvedPairs {
  dParallelSAPPair of(const dParallelSAPPair* pair) const { return *pair; }
  void prefetchAhead(const dParallelSAPPair* pair, bool reads) const {
    prefetch(pair + pairs_ahead / 4);
    if (reads) prefetchForCallback(pair[2 * geoms_ahead].o2, pair[geoms_ahead].o2);
  }
};

// Calls call(pair, geoms) from `pair` on, while no geom comes or leaves: that makes `limit` null. A
// callback that reads its geoms causes a cache miss a pair. Prefetching slows down one that only
// counts. The time of the first pairs of each stretch decides. From far_slots on, pairs and places
// in the table are prefetched in any case. False if pairs are left.
template <class Pairs, class Entry, class Call>
bool reportUnchanged(const Pairs& pairs, const Entry*& pair, const Entry* end, std::size_t slots,
                     const Reports& reports, const void*& limit, Call call) {
  constexpr std::ptrdiff_t stretch_pairs = chunk_pairs;
  constexpr std::ptrdiff_t tried_pairs = stretch_pairs / 32;  // as they wait; enough for a clock
  const bool far = slots >= far_slots;
  const double least_ms = slots >= many_geoms ? least_callback_ms_of_many : least_callback_ms;
  const auto setLimit = [&](const Entry* to) { limit = reports.changed() ? nullptr : to; };
  while (end - pair > tried_pairs && !reports.changed()) {
    const Entry *const tried = pair + tried_pairs, *const stretch =
                                                       pair + std::min(end - pair, stretch_pairs);
    // The callback is not to wait for what threads that found the pairs have in their caches.
    for (const Entry* next = pair; next < tried; ++next) {
      const dParallelSAPPair geoms = pairs.of(next);
      asm volatile("" : : "r"(geoms.o1), "r"(geoms.o2));
    }
    const Clock::time_point before = Clock::now();
    for (setLimit(tried); pair < limit; ++pair) call(pair, pairs.of(pair));
    const bool reads =
        milliseconds(before, Clock::now()) > least_ms * static_cast<double>(tried_pairs);
    if ((reads || far) && end - pair > pairs_ahead) setLimit(std::min(stretch, end - pairs_ahead));
    for (; pair < limit; ++pair) {
      pairs.prefetchAhead(pair, reads);
      call(pair, pairs.of(pair));
    }
    for (setLimit(stretch); pair < limit; ++pair) call(pair, pairs.of(pair));
  }
  for (setLimit(end); pair < limit; ++pair) call(pair, pairs.of(pair));
  return pair == end;
}

// Calls call(pair, place, a, b) for the pairs from a place on whose geoms are both there.
template <class Call>
void reportRest(const PairList& pairs, std::size_t place, const Scene& scene, Call call) {
  PairCursor(pairs).read(place, pairs.size(), [&](const Pair* begin, const Pair* end) {
    for (const Pair* pair = begin; pair < end; ++pair, ++place) {
      dxGeom *const a = scene.slots[earlierOf(*pair)], *const b = scene.slots[laterOf(*pair)];
      if (a && b) call(*pair, place, a, b);
    }
  });
}

// The same for all pairs of the scene, in their order, but for those of geoms that left meanwhile.
template <class Call>
void reportPairs(const PairList& pairs, const Scene& scene, const void*& limit, Call call) {
  std::size_t first = 0;  // the place of the run's first pair
  for (const PairList::Run& run : pairs.runs) {
    const Pair* pair = run.begin();
    const bool same = reportUnchanged(
        PairsBySlot{scene.slots.data()}, pair, run.end(), scene.slots.size(), scene.reports, limit,
        [&](const Pair* next, const dParallelSAPPair& geoms) {
          call(*next, first + static_cast<std::size_t>(next - run.begin()), geoms.o1, geoms.o2);
        });
    first += static_cast<std::size_t>(pair - run.begin());
    if (!same) return reportRest(pairs, first, scene, call);
  }
}

// Calls the callback for the same pairs in the same order. Threads resolve the geoms of
// resolved_pairs at a time, for which there is `room`. The calling thread alone would wait for the
// table of a large scene.
void reportResolved(const PairList& pairs, const Scene& scene, int threads, dParallelSAPPair* room,
                    const void*& limit, void* data, dNearCallback* callback);

// The arguments of dParallelSAPSpaceCollidePairs.
struct PairsRequest {
  void* data;
  int flags;
  dParallelSAPPairsCallback* callback;  // null: pairs are found, and none is handed out

  bool concurrent() const { return callback && (flags & dParallelSAPPairsConcurrent) != 0; }
};

// Gathers pairs in 8 KB, so that they are still in the cache when the callback reads them.
class PairBlock {
 public:
  // All blocks of a frame but the last one have this size, so that which blocks there are depends
  // on the pairs alone.
  static constexpr std::size_t size = 512;  // a round number

  // `pairs`: room for so many.
  PairBlock(const PairsRequest& request, dParallelSAPPair* pairs)
      : request_(request), pairs_(pairs) {}

  // Hands out full blocks, one after the other, and what is left in the end.
  PairReceiver receiver() { return {this, add, finish, !request_.concurrent(), leaveOut}; }

  // Hands out the block of pairs [first, first + size), or less at the end of `count`, on whatever
  // thread this is: in parts, between which geoms have left.
  void handOut(std::size_t first, std::size_t count, const Scene& scene, PairCursor& pairs);

 private:
  static void add(void* block, dGeomID o1, dGeomID o2);
  static void finish(void* block) { static_cast<PairBlock*>(block)->handOut(); }
  static void leaveOut(void* block);  // a pair
  void handOut();

  const PairsRequest& request_;
  std::size_t first_ = 0, held_ = 0;
  dParallelSAPPair* const pairs_;
};

// Hands out all of them, by up to `threads` threads if they may be concurrent. Returns how many
// worked. Does nothing without a callback.
int handOutBlocks(const PairList& pairs, const Scene& scene, const PairsRequest& request,
                  int threads);

}  // namespace ode_parallel_sap
