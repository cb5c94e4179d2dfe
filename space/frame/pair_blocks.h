// The pairs of a frame, handed out in blocks: dParallelSAPSpaceCollidePairs.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>

#include "space/base/pair_list.h"
#include "space/base/tuning.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

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
  static constexpr std::size_t size = block_pairs;

  // `pairs`: room for so many.
  PairBlock(const PairsRequest& request, dParallelSAPPair* pairs)
      : request_(request), pairs_(pairs) {}

  // A PairReceiver whose data are a PairBlock: hands out full blocks, one after the other, and what
  // is left in the end.
  static void add(void* block, dGeomID o1, dGeomID o2);
  static void finish(void* block) { static_cast<PairBlock*>(block)->handOut(); }
  static void leaveOut(void* block);  // a pair

  // Hands out the block of pairs [first, first + size), or less at the end of `count`, on whatever
  // thread this is: in parts, between which geoms have left.
  void handOut(std::size_t first, std::size_t count, const Scene& scene, PairCursor& pairs);

 private:
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
