#include "space/frame/pair_blocks.h"

#include <algorithm>
#include <atomic>

#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/contacts/contact_pairs.h"

namespace ode_parallel_sap {

namespace {

Region handing_out("pairs in blocks: blocks");

}  // namespace

void PairBlock::add(void* block, dGeomID o1, dGeomID o2) {
  PairBlock& self = *static_cast<PairBlock*>(block);
  self.pairs_[self.held_++] = {o1, o2};
  if (self.held_ == size) self.handOut();
}

void PairBlock::handOut() {
  if (held_ == 0) return;
  const std::size_t first = first_, count = held_;
  first_ += count;
  held_ = 0;
  if (request_.callback) request_.callback(request_.data, pairs_, count, first);
}

void PairBlock::handOut(std::size_t first, std::size_t count, dxGeom* const* geoms,
                        PairCursor& pairs) {
  dParallelSAPPair* to = pairs_;
  pairs.read(first, std::min(first + size, count),
             [&](const Pair* begin, const Pair* end) { to = resolve(begin, end, geoms, to); });
  request_.callback(request_.data, pairs_, static_cast<std::size_t>(to - pairs_), first);
}

// A thread whose callback throws keeps the others from beginning another block.
int handOutBlocks(const PairList& pairs, dxGeom* const* geoms, const PairsRequest& request,
                  int threads) {
  if (!request.callback) return 1;
  const std::size_t count = pairs.size();
  const int team = request.concurrent() ? teamFor(count, grains::handed_out_pairs, threads) : 1;
  std::atomic<bool> failed{false};
  ChunkQueue queue(count, PairBlock::size);
  return runTeam(handing_out, team, [&](int, int) {
    dParallelSAPPair room[PairBlock::size];
    PairBlock block(request, room);
    PairCursor cursor(pairs);
    Range range;
    try {
      while (!failed.load(std::memory_order_relaxed) && queue.next(range))
        block.handOut(range.begin, count, geoms, cursor);
    } catch (...) {
      failed.store(true, std::memory_order_relaxed);
      throw;
    }
  });
}

}  // namespace ode_parallel_sap
