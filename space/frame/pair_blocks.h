// The pairs of a frame, handed out in blocks: dParallelSAPSpaceCollidePairs.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>

#include "space/base/pair_list.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

// The arguments of dParallelSAPSpaceCollidePairs.
struct PairsRequest {
  void* data;
  int flags;
  dParallelSAPPairsCallback* callback;  // null: pairs are found, and none is handed out

  bool concurrent() const { return callback && (flags & dParallelSAPPairsConcurrent) != 0; }
};

// Pairs are gathered where the thread that hands them out has its stack, 8 KB of it, so that they
// are still in its cache when the callback reads them. Needs no other memory.
class PairBlock {
 public:
  // All blocks of a frame but the last one have this size, so that which blocks there are depends
  // on the pairs alone.
  static constexpr std::size_t size = block_pairs;

  explicit PairBlock(const PairsRequest& request) : request_(request) {}

  // A PairReceiver whose data are a PairBlock: hands out full blocks, one after the other, and what
  // is left in the end.
  static void add(void* block, dGeomID o1, dGeomID o2);
  static void finish(void* block) { static_cast<PairBlock*>(block)->handOut(); }

  // Hands out the block of pairs [first, first + size), or less at the end of `count`, on whatever
  // thread this is.
  void handOut(std::size_t first, std::size_t count, dxGeom* const* geoms, PairCursor& pairs);

 private:
  void handOut();

  const PairsRequest& request_;
  std::size_t first_ = 0, held_ = 0;
  dParallelSAPPair pairs_[size];
};

// Hands out all of them, by up to `threads` threads if they may be concurrent. Returns how many
// worked. Does nothing without a callback.
int handOutBlocks(const PairList& pairs, dxGeom* const* geoms, const PairsRequest& request,
                  int threads);

}  // namespace ode_parallel_sap
