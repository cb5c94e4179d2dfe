#include "space/frame/reports.h"

#include <atomic>

#include "space/base/parallel.h"
#include "space/contacts/contact_pairs.h"

namespace ode_parallel_sap {

static Region handing_out("pairs in blocks: blocks");

void reportResolved(const PairList& pairs, const Scene& scene, int threads, dParallelSAPPair* room,
                    const void*& limit, void* data, dNearCallback* callback) {
  const std::size_t count = pairs.size();
  std::size_t first = 0;
  for (bool same = true; same && first < count;) {
    const std::size_t size = std::min(resolved_pairs, count - first);
    resolve(pairs, {first, first + size}, scene.slots.data(), threads, room);
    const dParallelSAPPair* pair = room;
    same = reportUnchanged(ResolvedPairs(), pair, room + size, far_slots, scene.reports, limit,
                           [=](const dParallelSAPPair*, const dParallelSAPPair& geoms) {
                             callback(data, geoms.o1, geoms.o2);
                           });
    first += static_cast<std::size_t>(pair - room);
  }
  reportRest(pairs, first, scene,
             [=](Pair, std::size_t, dxGeom* a, dxGeom* b) { callback(data, a, b); });
}

void PairBlock::add(void* block, dGeomID o1, dGeomID o2) {
  PairBlock& self = *static_cast<PairBlock*>(block);
  self.pairs_[self.held_++] = {o1, o2};
  if (self.held_ == size) self.handOut();
}

void PairBlock::leaveOut(void* block) {
  PairBlock& self = *static_cast<PairBlock*>(block);
  self.handOut();
  ++self.first_;
}

void PairBlock::handOut() {
  if (held_ == 0) return;
  const std::size_t first = first_, count = held_;
  first_ += count;
  held_ = 0;
  if (request_.callback) request_.callback(request_.data, pairs_, count, first);
}

void PairBlock::handOut(std::size_t first, std::size_t count, const Scene& scene,
                        PairCursor& pairs) {
  const std::size_t last = std::min(first + size, count);
  const Buffer<dxGeom*>& geoms = scene.slots;
  if (!scene.reports.changed()) {
    dParallelSAPPair* to = pairs_;
    pairs.read(first, last, [&](const Pair* begin, const Pair* end) {
      to = resolve(begin, end, geoms.data(), to);
    });
    return request_.callback(request_.data, pairs_, last - first, first);
  }
  first_ = first;
  pairs.read(first, last, [&](const Pair* begin, const Pair* end) {
    for (const Pair* pair = begin; pair < end; ++pair) {
      dxGeom *const o1 = geoms[earlierOf(*pair)], *const o2 = geoms[laterOf(*pair)];
      o1&& o2 ? add(this, o1, o2) : leaveOut(this);
    }
  });
  handOut();
}

// A thread whose callback throws keeps the others from beginning another block.
int handOutBlocks(const PairList& pairs, const Scene& scene, const PairsRequest& request,
                  int threads) {
  if (!request.callback) return 1;
  const Reports::Open open(scene.reports, !request.concurrent());
  const std::size_t count = pairs.size();
  const int team = request.concurrent() ? teamFor(count, grains::items, threads) : 1;
  std::atomic<bool> failed{false};
  ChunkQueue queue(count, PairBlock::size);
  return runTeam(handing_out, team, [&](int, int) {
    dParallelSAPPair room[PairBlock::size];
    PairBlock block(request, room);
    PairCursor cursor(pairs);
    Range range;
    try {
      while (!failed.load(std::memory_order_relaxed) && queue.next(range))
        block.handOut(range.begin, count, scene, cursor);
    } catch (...) {
      failed.store(true, std::memory_order_relaxed);
      throw;
    }
  });
}

}  // namespace ode_parallel_sap
